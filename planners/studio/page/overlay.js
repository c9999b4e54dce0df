// What is drawn above the walls: base, goal, selection, the draft, the crosshair, and where planning failed.

import { pathOf, setPen } from "./scene.js";
import { handlesOf, HANDLE, RIM } from "./tools.js";
import { colours, numberText } from "./view.js";

const TURN = 2 * Math.PI;

function dot(context, x, y, radius, fill, edge) {
  context.beginPath();
  context.arc(x, y, radius, 0, TURN);
  context.fillStyle = fill;
  context.fill();
  context.lineWidth = 2;
  context.strokeStyle = edge;
  context.stroke();
}

export function drawGoal(context, view, tool) {
  const { scene } = view;
  if (!scene.goal) return;
  const [x, y] = view.toScreen(...scene.goal), radius = scene.goal_radius * view.scale;
  context.beginPath();
  context.arc(x, y, Math.max(radius, 3), 0, TURN);
  context.fillStyle = colours.goal;
  context.globalAlpha = 0.28;
  context.fill();
  context.globalAlpha = 1;
  context.strokeStyle = colours.goal;
  context.lineWidth = 2;
  context.stroke();
  dot(context, x, y, 4, colours.goal, colours.goal);
  if (tool === "goal" || tool === "select") dot(context, x + radius + RIM, y, 5, colours.card, colours.goal);
}

export function drawBase(context, view, tool, linkLength) {
  const { scene } = view;
  if (!scene.base) return;
  const [x, y] = view.toScreen(scene.base[0], scene.base[1]), angle = -scene.base[2] * Math.PI / 180;
  context.save();
  context.translate(x, y);
  context.rotate(angle);
  if (linkLength > 0) { // the first link, as it comes in
    context.strokeStyle = colours.arm;
    context.globalAlpha = 0.55;
    context.setLineDash([7, 5]);
    context.lineWidth = 2;
    context.beginPath();
    context.moveTo(0, 0);
    context.lineTo(Math.min(linkLength * view.scale, 1e5), 0);
    context.stroke();
    context.setLineDash([]);
    context.globalAlpha = 1;
  }
  context.fillStyle = colours.base;
  context.fillRect(-30, -8, 30, 16);
  context.fillStyle = colours.card;
  context.fillRect(-26, -4, 26, 8);
  context.beginPath();
  context.moveTo(14, 0);
  context.lineTo(0, 8);
  context.lineTo(0, -8);
  context.closePath();
  context.fillStyle = colours.base;
  context.fill();
  if (tool === "base" || tool === "select") {
    context.strokeStyle = colours.base;
    context.lineWidth = 1;
    context.beginPath();
    context.moveTo(14, 0);
    context.lineTo(HANDLE, 0);
    context.stroke();
    dot(context, HANDLE, 0, 6, colours.card, colours.base);
  }
  context.restore();
}

export function drawSelection(context, view, number) {
  const shape = view.scene.shapes[number];
  if (!shape) return;
  view.setWorld(context);
  const path = pathOf(shape, view.origin);
  context.strokeStyle = colours.accent;
  if (shape.line) {
    setPen(context, shape.width);
    context.globalAlpha = 0.16;
    context.stroke(path);
  }
  context.globalAlpha = 1;
  context.lineWidth = 2 / view.scale;
  context.lineJoin = "round";
  context.stroke(path);
  context.setTransform(view.ratio, 0, 0, view.ratio, 0, 0);
  const { corners, middles } = handlesOf(shape);
  for (const { x, y } of middles) dot(context, ...view.toScreen(x, y), 3, colours.card, colours.accent);
  for (const { x, y } of corners) dot(context, ...view.toScreen(x, y), 6, colours.card, colours.accent);
}

/** The shape as it would become with the place under the pointer, and the places that are set. */
export function drawDraft(context, view, { tool, points, next, options }) {
  if (!points.length) return;
  const all = next ? [...points, next] : points;
  const shape = all.length >= tool.least ? tool.build(all, options) : { role: "free", line: all, width: 0 };
  if (shape && all.length > 1) {
    view.setWorld(context);
    const path = pathOf(shape, view.origin);
    context.globalAlpha = 0.3;
    context.fillStyle = context.strokeStyle = colours.accent;
    if (shape.line && shape.width) {
      setPen(context, shape.width);
      context.stroke(path);
    } else if (!shape.line) context.fill(path, "evenodd");
    context.globalAlpha = 1;
    context.lineWidth = 1.5 / view.scale;
    context.stroke(path);
    context.setTransform(view.ratio, 0, 0, view.ratio, 0, 0);
  }
  for (const [x, y] of points) dot(context, ...view.toScreen(x, y), 5, colours.accent, colours.card);
  if (next) {
    const [from, to] = all.slice(-2), [sx, sy] = view.toScreen(...next);
    label(context, view, `${numberText(Math.hypot(to[0] - from[0], to[1] - from[1]), 4)} ${view.scene.units}`, sx + 14, sy - 14);
  }
}

export function drawCrosshair(context, view, [x, y], picked) {
  const [sx, sy] = view.toScreen(x, y);
  for (const [colour, wide] of [[colours.card, 4], [picked ? colours.accent : colours.ink, 1.5]]) {
    context.strokeStyle = colour;
    context.lineWidth = wide;
    context.beginPath();
    for (const [dx, dy] of [[1, 0], [-1, 0], [0, 1], [0, -1]]) {
      context.moveTo(sx + 5 * dx, sy + 5 * dy);
      context.lineTo(sx + 17 * dx, sy + 17 * dy);
    }
    context.stroke();
  }
  label(context, view, `${numberText(x)}, ${numberText(y)}`, sx + 14, sy + 26);
}

/** Where planning failed: the arm as far as it came, and the place. */
export function drawFailure(context, view, { place, joints, text }) {
  context.strokeStyle = colours.bad;
  if (joints && joints.length > 1) {
    context.lineWidth = 3;
    context.lineJoin = "round";
    context.beginPath();
    joints.forEach(([x, y], k) => { const at = view.toScreen(x, y); if (k) context.lineTo(...at); else context.moveTo(...at); });
    context.stroke();
    for (const [x, y] of joints) dot(context, ...view.toScreen(x, y), 3, colours.bad, colours.card);
  }
  if (!place) return;
  const [sx, sy] = view.toScreen(...place);
  context.lineWidth = 2.5;
  context.strokeStyle = colours.bad;
  context.beginPath();
  context.arc(sx, sy, 15, 0, TURN);
  context.moveTo(sx - 6, sy - 6);
  context.lineTo(sx + 6, sy + 6);
  context.moveTo(sx + 6, sy - 6);
  context.lineTo(sx - 6, sy + 6);
  context.stroke();
  if (text) label(context, view, text, sx + 20, sy - 12, colours.bad);
}

function label(context, view, text, x, y, colour = colours.ink) {
  context.font = "600 12px system-ui, sans-serif";
  context.textAlign = "left";
  context.textBaseline = "middle";
  const wide = context.measureText(text).width;
  const left = Math.max(8, Math.min(x, view.width - wide - 12)), top = Math.max(14, Math.min(y, view.height - 14));
  context.globalAlpha = 0.9;
  context.fillStyle = colours.card;
  context.beginPath();
  context.roundRect(left - 5, top - 10, wide + 10, 20, 5);
  context.fill();
  context.globalAlpha = 1;
  context.fillStyle = colour;
  context.fillText(text, left, top + 0.5);
}
