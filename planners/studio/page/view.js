// The canvas: what of the scene is seen, and how it is drawn.

import { EDGE, boundsOf, pathOf, roundStep, setPen } from "./scene.js";

const NAMES = ["page", "card", "ink", "soft", "line", "accent", "wall", "edge", "free", "goal", "base", "arm", "near", "joint", "bad", "pinch"];
export const colours = {};
export function readColours() {
  const values = getComputedStyle(document.documentElement);
  for (const name of NAMES) colours[name] = values.getPropertyValue("--" + name).trim();
}

/** Write a number as short as it is read: a real minus, no dust. */
export function numberText(value, digits = 6) {
  return String(Number(value.toPrecision(digits))).replace("-", "\u2212");
}

const MARGIN = 0.25; // of the canvas, on each side

export class View {
  constructor(canvas) {
    Object.assign(this, { canvas, x: 0, y: 0, scale: 1, width: 1, height: 1, ratio: 1, awaited: false, painters: [] });
    [this.kept, this.mask, this.tinted] = ["kept", "mask", "tinted"].map(() => document.createElement("canvas"));
    this.origin = [0, 0];
    this.scene = null;
    this.drawn = { key: "" }; // what `kept` shows: walls and free space, with some margin while the view is moved
    this.drawTimes = [];
  }

  show(scene) {
    this.scene = scene;
    const { x0, y0, x1, y1 } = boundsOf(scene);
    const far = Math.max(x1 - x0, y1 - y0);
    if (Math.hypot(x0 - this.origin[0], y0 - this.origin[1]) > 50 * far) this.origin = [x0, y0];
    this.redraw();
  }

  resize() {
    const box = this.canvas.getBoundingClientRect();
    if (!box.width || !box.height) return false;
    const first = this.width === 1;
    this.ratio = window.devicePixelRatio || 1;
    Object.assign(this, { width: box.width, height: box.height });
    this.canvas.width = Math.round(box.width * this.ratio);
    this.canvas.height = Math.round(box.height * this.ratio);
    this.redraw();
    return first;
  }

  // Screen: CSS pixels of the canvas. World: the scene's units, y up.
  toScreen(x, y) { return [this.width / 2 + (x - this.x) * this.scale, this.height / 2 - (y - this.y) * this.scale]; }
  toWorld(sx, sy) { return [this.x + (sx - this.width / 2) / this.scale, this.y - (sy - this.height / 2) / this.scale]; }

  zoomBy(factor, sx = this.width / 2, sy = this.height / 2) {
    const [x, y] = this.toWorld(sx, sy);
    this.scale = Math.min(Math.max(this.scale * factor, 1e-5), 1e7);
    const [nx, ny] = this.toWorld(sx, sy);
    this.x += x - nx;
    this.y += y - ny;
    this.panBy(0, 0);
  }
  panBy(dx, dy) {
    const kept = (value) => Math.min(Math.max(value, -EDGE), EDGE);
    this.x = kept(this.x - dx / this.scale);
    this.y = kept(this.y + dy / this.scale);
    this.redraw();
  }
  fit(scene = this.scene) {
    const { x0, x1, y0, y1 } = boundsOf(scene);
    const room = Math.min(56, this.width / 8);
    Object.assign(this, { x: (x0 + x1) / 2, y: (y0 + y1) / 2 });
    this.scale = Math.min((this.width - 2 * room) / Math.max(x1 - x0, 1e-9), (this.height - 2 * room) / Math.max(y1 - y0, 1e-9));
    this.scale = Math.min(Math.max(this.scale, 1e-7), 1e7);
    this.redraw();
  }
  /** Bring a place into view. */
  reveal(x, y) {
    const [sx, sy] = this.toScreen(x, y), margin = 24;
    const over = (value, size) => Math.min(value - margin, 0) + Math.max(value - size + margin, 0);
    this.panBy(-over(sx, this.width), -over(sy, this.height));
  }
  get gridStep() { return roundStep(10 / this.scale); }

  redraw() {
    if (this.awaited) return;
    this.awaited = true;
    requestAnimationFrame(() => {
      this.awaited = false;
      if (this.scene && this.width > 1) this.draw();
    });
  }

  draw() {
    const began = performance.now();
    const context = this.canvas.getContext("2d");
    this.keep();
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.drawImage(this.kept, ...this.keptAt());
    context.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
    this.drawGrid(context);
    for (const painter of this.painters) painter(context, this);
    this.drawScaleBar(context);
    this.drawTimes.push(performance.now() - began);
    if (this.drawTimes.length > 300) this.drawTimes.shift();
  }

  /** Where on the canvas `kept` belongs, in whole pixels: between them it would blur. */
  keptAt() {
    const { canvas, kept, drawn, x, y } = this, s = this.scale * this.ratio;
    return [(canvas.width - kept.width) / 2 + (drawn.x - x) * s, (canvas.height - kept.height) / 2 - (drawn.y - y) * s].map(Math.round);
  }
  /** Draw walls and free space, unless that has been done: a view that is only moved finds them drawn. */
  keep() {
    const { canvas, kept, scene, x, y, drawn } = this;
    const key = [this.scale, this.ratio, canvas.width, canvas.height, colours.wall, colours.edge, colours.free].join();
    const same = key === drawn.key && scene.shapes === drawn.shapes;
    if (same) {
      const [left, top] = this.keptAt();
      if (x === drawn.x && y === drawn.y) return;
      if (left <= 0 && top <= 0 && left + kept.width >= canvas.width && top + kept.height >= canvas.height) return;
    }
    this.drawn = { key, shapes: scene.shapes, x, y };
    for (const one of [kept, this.mask, this.tinted]) { // even differences: whole pixels on either side
      one.width = canvas.width + (same ? 2 * Math.round(MARGIN * canvas.width) : 0);
      one.height = canvas.height + (same ? 2 * Math.round(MARGIN * canvas.height) : 0);
    }
    this.drawMask();
    const context = kept.getContext("2d");
    context.fillStyle = colours.wall;
    context.fillRect(0, 0, kept.width, kept.height);
    this.tint(colours.edge);
    const by = Math.max(1, this.ratio);
    for (const [dx, dy] of [[by, 0], [-by, 0], [0, by], [0, -by], [by, by], [-by, by], [by, -by], [-by, -by]]) context.drawImage(this.tinted, dx, dy);
    this.tint(colours.free);
    context.drawImage(this.tinted, 0, 0);
  }

  /** Fold the shapes as the planner does: free adds to the free space, a wall takes away from it. */
  drawMask() {
    const { mask, canvas, scene, scale, ratio } = this, context = mask.getContext("2d"), s = scale * ratio;
    const [left, top] = this.toScreen(...this.origin);
    context.setTransform(s, 0, 0, -s, left * ratio + (mask.width - canvas.width) / 2, top * ratio + (mask.height - canvas.height) / 2);
    for (const shape of scene.shapes) {
      context.globalCompositeOperation = shape.role === "free" ? "source-over" : "destination-out";
      const path = pathOf(shape, this.origin);
      if (shape.line) {
        setPen(context, shape.width);
        context.stroke(path);
      } else context.fill(path, "evenodd");
    }
  }
  /** Let a context draw in the scene's units, from the origin of its paths. */
  setWorld(context, ratio = this.ratio) {
    const [left, top] = this.toScreen(...this.origin), s = this.scale * ratio;
    context.setTransform(s, 0, 0, -s, left * ratio, top * ratio);
  }
  tint(colour) {
    const context = this.tinted.getContext("2d");
    context.globalCompositeOperation = "copy";
    context.drawImage(this.mask, 0, 0);
    context.globalCompositeOperation = "source-in";
    context.fillStyle = colour;
    context.fillRect(0, 0, this.tinted.width, this.tinted.height);
  }

  drawGrid(context) {
    const step = this.gridStep, [x0, y1] = this.toWorld(0, 0), [x1, y0] = this.toWorld(this.width, this.height);
    const often = step / 10 ** Math.floor(Math.log10(step) + 1e-9) > 4 ? 4 : 5; // heavier lines at round numbers
    context.strokeStyle = colours.soft;
    context.lineWidth = 1;
    for (const [heavy, alpha] of [[false, 0.1], [true, 0.22]]) {
      context.globalAlpha = alpha;
      context.beginPath();
      for (let k = Math.ceil(x0 / step); k <= x1 / step; k++) {
        if ((k % often === 0) !== heavy) continue;
        const sx = Math.round(this.toScreen(k * step, 0)[0]) + 0.5;
        context.moveTo(sx, 0);
        context.lineTo(sx, this.height);
      }
      for (let k = Math.ceil(y0 / step); k <= y1 / step; k++) {
        if ((k % often === 0) !== heavy) continue;
        const sy = Math.round(this.toScreen(0, k * step)[1]) + 0.5;
        context.moveTo(0, sy);
        context.lineTo(this.width, sy);
      }
      context.stroke();
    }
    context.globalAlpha = 1;
  }

  drawScaleBar(context) {
    let length = roundStep(110 / this.scale);
    if (length * this.scale > 150) length /= 2;
    const text = `${numberText(length)} ${this.scene.units}`, wide = length * this.scale;
    const x = 14, y = this.height - 16;
    context.font = "600 12px system-ui, sans-serif";
    context.textAlign = "center";
    context.textBaseline = "bottom";
    for (const [colour, thick] of [[colours.card, 5], [colours.ink, 2]]) {
      context.strokeStyle = colour;
      context.lineWidth = thick;
      context.lineCap = "round";
      context.lineJoin = "round";
      context.beginPath();
      context.moveTo(x, y - 5);
      context.lineTo(x, y);
      context.lineTo(x + wide, y);
      context.lineTo(x + wide, y - 5);
      context.stroke();
      context.lineWidth = 4;
      if (thick === 5) context.strokeText(text, x + wide / 2, y - 5);
    }
    context.fillStyle = colours.ink;
    context.fillText(text, x + wide / 2, y - 5);
  }
}
