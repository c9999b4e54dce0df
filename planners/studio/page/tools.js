// The tools: how places become shapes, and what can be taken hold of and moved. Nothing here knows of events.

import { circle, covers, moved, pointsOf, rectangle, tidy, withPoints } from "./scene.js";

/** Tools that set places. `least` and `most` places make a shape; `build` may return null: too small. */
export const DRAWING = {
  corridor: {
    name: "Corridor", key: "c", least: 2, most: Infinity, width: "corridor",
    hint: "Set the corners of the corridor's middle line; the last one twice, or Enter twice, ends it.",
    build: (points, { corridor }) => ({ role: "free", line: points, width: corridor }),
  },
  room: {
    name: "Room", key: "r", least: 2, most: 2, hint: "Drag from corner to corner, or set two corners.",
    build: ([a, b]) => (a[0] === b[0] || a[1] === b[1] ? null : { role: "free", rings: [rectangle(a, b)] }),
  },
  polygon: {
    name: "Polygon", key: "p", least: 3, most: Infinity, closed: true,
    hint: "Set corners; the last or first one again ends the outline.",
    build: (points, { polygon }) => ({ role: polygon, rings: [points] }),
  },
  wall: {
    name: "Wall", key: "w", least: 2, most: Infinity, width: "wall",
    hint: "Set the corners of a wall of even thickness; the last one twice ends it.",
    build: (points, { wall }) => ({ role: "wall", line: points, width: wall }),
  },
  pillar: {
    name: "Pillar", key: "o", least: 2, most: 2, hint: "Drag a pillar open: from the middle of a round one, from a corner of a square one.",
    build: ([a, b], { pillar }) => {
      const radius = Math.hypot(b[0] - a[0], b[1] - a[1]);
      if (pillar === "circle") return radius > 0 ? { role: "wall", rings: [circle(a, radius)] } : null;
      return a[0] === b[0] || a[1] === b[1] ? null : { role: "wall", rings: [rectangle(a, b)] };
    },
  },
};

/** Tools that take hold of what is there, or set it. */
export const MOVING = {
  select: { name: "Select", key: "v", hint: "Drag shapes, corners, base and goal; the small dots add a corner. Delete removes." },
  base: { name: "Base", key: "b", hint: "Where the arm comes in: click or drag; the handle turns it." },
  goal: { name: "Goal", key: "g", hint: "Where the tip shall go: click or drag; the handle sets the radius." },
  pan: { name: "Move the view", key: "h", hint: "Drag the view; wheel or two fingers zoom. Space with any tool does the same." },
};

export const HANDLE = 44; // px from the base to the handle that turns it
export const RIM = 13; // px from the goal's edge to the handle of its radius
const MANY = 80; // shapes with more corners show none: they are moved as a whole

export function shapeName(scene, number) {
  const shape = scene.shapes[number];
  const kind = shape.line ? (shape.role === "free" ? "corridor" : "wall") : shape.role === "free" ? "room" : "block";
  return `${kind} ${number + 1}`;
}

/** Corners that can be moved, and the middles of edges, where one can be added. */
export function handlesOf(shape) {
  const points = pointsOf(shape);
  if (points.length > MANY) return { corners: [], middles: [] };
  const middles = [];
  for (const at of points) {
    const ring = shape.line ?? shape.rings[at.ring], next = ring[(at.k + 1) % ring.length];
    if (shape.line && at.k === ring.length - 1) continue;
    middles.push({ ring: at.ring, k: at.k, x: (at.x + next[0]) / 2, y: (at.y + next[1]) / 2 });
  }
  return { corners: points, middles };
}

/** Places of base, goal and their handles, on the canvas' scale. */
export function marksOf(scene, scale) {
  const marks = [];
  if (scene.base) {
    const [x, y, heading] = scene.base, angle = heading * Math.PI / 180;
    marks.push({ kind: "turn", x: x + HANDLE / scale * Math.cos(angle), y: y + HANDLE / scale * Math.sin(angle) });
    marks.push({ kind: "base", x, y });
  }
  if (scene.goal) {
    const [x, y] = scene.goal;
    marks.push({ kind: "radius", x: x + scene.goal_radius + RIM / scale, y });
    marks.push({ kind: "goal", x, y });
  }
  return marks;
}

/**
 * Take hold of what is at a place. Returns {kind, name, at, select, apply(scene, to, free) -> scene} or null; `select`
 * is the number of the shape that is selected by it.
 */
export function grabAt(scene, [x, y], { scale, selected, only, reach = 12 }) {
  const near = (mark) => Math.hypot(mark.x - x, mark.y - y) * scale <= reach;
  const kinds = { base: ["turn", "base"], goal: ["radius", "goal"] }[only] ?? ["turn", "base", "radius", "goal"];
  const goalReach = (mark) => mark.kind === "goal" && Math.hypot(mark.x - x, mark.y - y) <= scene.goal_radius;
  const mark = marksOf(scene, scale).find((one) => kinds.includes(one.kind) && (near(one) || goalReach(one)));
  if (mark) return markGrab(mark, scale);
  if (only) return null;
  if (selected >= 0) {
    const { corners, middles } = handlesOf(scene.shapes[selected]);
    const corner = corners.find(near), middle = corner ? null : middles.find(near);
    if (corner || middle) return cornerGrab(scene, selected, corner ?? middle, Boolean(middle));
  }
  const number = scene.shapes.findLastIndex((shape) => covers(shape, x, y, 12 / scale));
  if (number < 0) return null;
  const from = [x, y], shape = scene.shapes[number];
  return {
    kind: "shape", name: shapeName(scene, number), at: from, select: number,
    apply: (old, to) => put(old, number, moved(shape, to[0] - from[0], to[1] - from[1])),
  };
}

function put(scene, number, shape) {
  return { ...scene, shapes: scene.shapes.map((old, k) => (k === number ? shape : old)) };
}

function markGrab({ kind, x, y }, scale) {
  const name = { turn: "heading of the base", base: "base", radius: "radius of the goal", goal: "goal" }[kind];
  const apply = {
    base: (scene, to) => ({ ...scene, base: [to[0], to[1], scene.base[2]] }),
    goal: (scene, to) => ({ ...scene, goal: [to[0], to[1]] }),
    turn: (scene, to, free) => {
      const turn = Math.atan2(to[1] - scene.base[1], to[0] - scene.base[0]) * 180 / Math.PI;
      const step = free ? 0.1 : 5; // deg
      return { ...scene, base: [scene.base[0], scene.base[1], tidy(Math.round(turn / step) * step)] };
    },
    radius: (scene, to) => {
      const radius = Math.hypot(to[0] - scene.goal[0], to[1] - scene.goal[1]) - RIM / scale;
      return { ...scene, goal_radius: Math.max(Number(radius.toPrecision(3)), Number((2 / scale).toPrecision(2))) };
    },
  }[kind];
  return { kind, name, at: [x, y], select: -1, smooth: kind === "turn" || kind === "radius", apply };
}

function cornerGrab(scene, number, { ring, k, x, y }, added) {
  const shape = scene.shapes[number], old = ring < 0 ? shape.line : shape.rings[ring];
  const points = added ? [...old.slice(0, k + 1), [x, y], ...old.slice(k + 1)] : old;
  const at = added ? k + 1 : k;
  return {
    kind: "corner", name: `corner ${at + 1} of ${shapeName(scene, number)}`, at: [x, y], select: number, corner: { ring, k: at },
    apply: (now, to) => put(now, number, withPoints(shape, ring, points.map((point, j) => (j === at ? to : point)))),
  };
}

/** Take a corner out of a shape; null if too few are left. */
export function withoutCorner(shape, { ring, k }) {
  const points = (ring < 0 ? shape.line : shape.rings[ring]).filter((_, j) => j !== k);
  if (points.length >= (ring < 0 ? 2 : 3)) return withPoints(shape, ring, points);
  return ring > 0 ? { ...shape, rings: shape.rings.filter((_, j) => j !== ring) } : null;
}

/** Turn the way from one place to another into the nearest multiple of 45 degrees. */
export function straightened(from, to) {
  const dx = to[0] - from[0], dy = to[1] - from[1];
  const angle = Math.round(Math.atan2(dy, dx) / (Math.PI / 4)) * Math.PI / 4;
  const along = dx * Math.cos(angle) + dy * Math.sin(angle);
  return [tidy(from[0] + along * Math.cos(angle)), tidy(from[1] + along * Math.sin(angle))];
}
