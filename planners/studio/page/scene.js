// What is drawn: shapes in the order of drawing, base, goal. Scenes are never changed, only replaced, so that
// undo is a list of them. Lengths are in the scene's units, y up; headings in degrees.

export const START = {
  name: "u-turn", units: "px",
  shapes: [{ role: "free", line: [[0, 0], [0, 1500], [240, 1500], [240, 0]], width: 200 }],
  base: [0, 5, 90], goal: [240, 700], goal_radius: 25,
};
export const START_LINK = 430;

export const EMPTY = { name: "my-maze", units: "mm", shapes: [], base: null, goal: null, goal_radius: 25 };

const FARTHEST = 1e9, MAX_POINTS = 20000; // the server's limits, too

/** Nothing is drawn farther out than this. */
export const EDGE = 0.9 * FARTHEST;

const isNumber = (value) => typeof value === "number" && Number.isFinite(value) && Math.abs(value) < FARTHEST;
const isPlace = (value) => Array.isArray(value) && value.length >= 2 && isNumber(value[0]) && isNumber(value[1]);

/** Return a scene from data that anybody may have written; throws one sentence. */
export function checkedScene(data) {
  const refuse = (what) => { throw new Error(`Expected a drawing, but ${what}.`); };
  if (data === null || typeof data !== "object" || !Array.isArray(data.shapes)) refuse("there are no shapes in it");
  const shapes = data.shapes.map((shape, number) => checkedShape(shape, (what) => refuse(`shape ${number + 1} ${what}`)));
  if (shapes.reduce((sum, shape) => sum + pointsOf(shape).length, 0) > MAX_POINTS) refuse(`it has over ${MAX_POINTS} points`);
  if (data.base != null && !(isPlace(data.base) && isNumber(data.base[2]))) refuse("its base is not x, y and a heading");
  if (data.goal != null && !isPlace(data.goal)) refuse("its goal is not x and y");
  const radius = data.goal_radius ?? null;
  if (radius !== null && !(isNumber(radius) && radius > 0)) refuse("its goal has no positive radius");
  const text = (value, otherwise) => (typeof value === "string" && value.trim() ? value.slice(0, 100) : otherwise);
  const scene = {
    name: text(data.name, "maze"), units: text(data.units, "px").slice(0, 40), shapes,
    base: data.base ? data.base.slice(0, 3) : null, goal: data.goal ? data.goal.slice(0, 2) : null,
    goal_radius: radius,
  };
  scene.goal_radius ??= rounded(sizeOf(scene) / 60) || 1;
  return scene;
}

function checkedShape(shape, refuse) {
  if (shape === null || typeof shape !== "object" || !["free", "wall"].includes(shape.role)) refuse("is neither free nor a wall");
  const places = (list, least) => {
    if (!Array.isArray(list) || !list.every(isPlace)) refuse("has a corner that is not two finite numbers");
    const kept = list.map(([x, y]) => [x, y]);
    const [first, last] = [kept[0], kept[kept.length - 1]];
    if (least === 3 && kept.length > 3 && first[0] === last[0] && first[1] === last[1]) kept.pop(); // closed by itself
    if (kept.length < least) refuse(`has fewer than ${least} corners`);
    return kept;
  };
  if (shape.line !== undefined) {
    if (!(isNumber(shape.width) && shape.width > 0)) refuse("has no positive width");
    return { role: shape.role, line: places(shape.line, 2), width: shape.width };
  }
  if (!Array.isArray(shape.rings) || !shape.rings.length) refuse("has no outline");
  return { role: shape.role, rings: shape.rings.map((ring) => places(ring, 3)) };
}

/** The corners of a shape, and where they stand in it. */
export function pointsOf(shape) {
  if (shape.line) return shape.line.map(([x, y], k) => ({ ring: -1, k, x, y }));
  return shape.rings.flatMap((ring, number) => ring.map(([x, y], k) => ({ ring: number, k, x, y })));
}

/** Return a shape with the corners of one ring, or of its line, replaced. */
export function withPoints(shape, ring, points) {
  if (ring < 0) return { ...shape, line: points };
  return { ...shape, rings: shape.rings.map((old, number) => (number === ring ? points : old)) };
}

export function moved(shape, dx, dy) {
  if (pointsOf(shape).some(({ x, y }) => Math.abs(x + dx) > EDGE || Math.abs(y + dy) > EDGE)) return shape;
  const shift = (points) => points.map(([x, y]) => [tidy(x + dx), tidy(y + dy)]);
  return shape.line ? { ...shape, line: shift(shape.line) } : { ...shape, rings: shape.rings.map(shift) };
}

/** Cut off the dust that sums of decimals leave. */
export function tidy(value) {
  return value === 0 ? 0 : Number(value.toPrecision(12));
}

export function rectangle([x0, y0], [x1, y1]) {
  return [[x0, y0], [x1, y0], [x1, y1], [x0, y1]];
}

export function circle([x, y], radius, corners = 36) {
  return Array.from({ length: corners }, (_, k) => {
    const angle = 2 * Math.PI * k / corners;
    return [tidy(x + radius * Math.cos(angle)), tidy(y + radius * Math.sin(angle))];
  });
}

/** The bounding box of all that is in a scene: {x0, x1, y0, y1}. */
export function boundsOf(scene) {
  const box = { x0: Infinity, x1: -Infinity, y0: Infinity, y1: -Infinity };
  const add = (x, y, by) => {
    Object.assign(box, { x0: Math.min(box.x0, x - by), x1: Math.max(box.x1, x + by), y0: Math.min(box.y0, y - by), y1: Math.max(box.y1, y + by) });
  };
  for (const shape of scene.shapes) for (const { x, y } of pointsOf(shape)) add(x, y, shape.line ? shape.width / 2 : 0);
  if (scene.base) add(scene.base[0], scene.base[1], 0);
  if (scene.goal) add(scene.goal[0], scene.goal[1], scene.goal_radius);
  if (box.x0 > box.x1) return { x0: 0, x1: 1000, y0: 0, y1: 700 };
  if (box.x1 - box.x0 + box.y1 - box.y0 === 0) add(box.x0, box.y0, 100);
  return box;
}

export function sizeOf(scene) {
  const { x0, x1, y0, y1 } = boundsOf(scene);
  return Math.hypot(x1 - x0, y1 - y0);
}

/** The next of 1, 2, 5, 10, 20, ... that is at least a value. */
export function roundStep(value) {
  const power = 10 ** Math.floor(Math.log10(value)), share = value / power;
  return tidy(power * ([1, 2, 5, 10].find((step) => share <= step * (1 + 1e-9)) ?? 10));
}

/** A value with two digits. */
export function rounded(value) {
  return Number(value.toPrecision(2));
}

// Paths of shapes, relative to an origin near them: a canvas computes in single precision.

const paths = new WeakMap();
export function pathOf(shape, origin) {
  const kept = paths.get(shape);
  if (kept && kept.origin === origin) return kept.path;
  const path = tracedPath(shape, origin);
  paths.set(shape, { origin, path });
  return path;
}
function tracedPath(shape, [ox, oy]) {
  const path = new Path2D();
  for (const points of shape.line ? [shape.line] : shape.rings) {
    points.forEach(([x, y], k) => { if (k) path.lineTo(x - ox, y - oy); else path.moveTo(x - ox, y - oy); });
    if (!shape.line) path.closePath();
  }
  return path;
}

/** Set a pen to draw a corridor or a thick wall as the planner sees it: flat ends, mitred corners. */
export function setPen(context, width) {
  Object.assign(context, { lineWidth: width, lineCap: "butt", lineJoin: "miter", miterLimit: 10 });
}

const localPaths = new WeakMap();
function localPath(shape, origin) {
  if (!localPaths.has(shape)) localPaths.set(shape, tracedPath(shape, origin));
  return localPaths.get(shape);
}

const probe = document.createElement("canvas").getContext("2d");

/** Whether a place is in a shape, or within `reach` of its line. */
export function covers(shape, x, y, reach = 0) {
  const origin = (shape.line ?? shape.rings[0])[0], path = localPath(shape, origin);
  if (!shape.line) return probe.isPointInPath(path, x - origin[0], y - origin[1], "evenodd");
  setPen(probe, Math.max(shape.width, reach));
  return probe.isPointInStroke(path, x - origin[0], y - origin[1]);
}

/** What the planner will find at a place: what was drawn last counts, and a wall where nothing was. */
export function isFree(scene, x, y) {
  const top = scene.shapes.findLast((shape) => covers(shape, x, y));
  return top !== undefined && top.role === "free";
}

/** Sentences on what cannot be planned, before anybody is asked. */
export function faultsOf(scene, linkLength) {
  const faults = [];
  if (!scene.shapes.some(({ role }) => role === "free")) return ["Nothing is free yet: draw a corridor or a room."];
  if (!scene.base) faults.push("Set the base: where the arm comes in.");
  else if (!isFree(scene, scene.base[0], scene.base[1])) faults.push("The base is in a wall.");
  if (!scene.goal) faults.push("Set the goal.");
  else if (!isFree(scene, scene.goal[0], scene.goal[1])) faults.push("The goal is in a wall.");
  if (faults.length || !(linkLength > 0)) return faults;
  const [x, y, heading] = scene.base, angle = heading * Math.PI / 180;
  for (let k = 1; k < 40; k++) {
    const s = linkLength * k / 40;
    if (!isFree(scene, x + s * Math.cos(angle), y + s * Math.sin(angle)))
      return [`One link of ${linkLength} ${scene.units} does not fit straight in front of the base: it is free for about ${rounded(s)} ${scene.units}.`];
  }
  return faults;
}

/** The scene that is shown, and the ones before and after it. */
export class Store {
  constructor(scene) {
    Object.assign(this, { scene, past: [], future: [], held: null, listeners: [] });
  }
  listen(listener) { this.listeners.push(listener); }
  tell() { for (const listener of this.listeners) listener(this.scene); }

  set(scene) {
    if (this.held === null) {
      this.past.push(this.scene);
      if (this.past.length > 300) this.past.shift();
      this.future = [];
    }
    this.scene = scene;
    this.tell();
  }
  change(part) { this.set({ ...this.scene, ...part }); }
  changeShape(number, shape) {
    this.change({ shapes: this.scene.shapes.map((old, k) => (k === number ? shape : old)) });
  }

  /** While something is dragged, no step of it is kept: only the scene before. */
  hold() { this.held = this.scene; }
  drop() {
    const { held } = this;
    this.held = null;
    if (held === null || held === this.scene) return;
    const { scene } = this;
    this.scene = held;
    this.set(scene);
  }
  putBack() {
    const { held } = this;
    this.held = null;
    if (held === null) return;
    this.scene = held;
    this.tell();
  }
  undo() { return this.step(this.past, this.future); }
  redo() { return this.step(this.future, this.past); }
  step(from, to) {
    if (!from.length || this.held !== null) return false;
    to.push(this.scene);
    this.scene = from.pop();
    this.tell();
    return true;
  }
}
