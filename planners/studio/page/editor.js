// Mouse, touch and keys on the canvas. All of them end in the same few acts: a place is set, something is taken
// hold of, moved and dropped.

import { EDGE, tidy } from "./scene.js";
import { DRAWING, MOVING, grabAt, marksOf, handlesOf, shapeName, straightened, withoutCorner } from "./tools.js";
import { drawBase, drawCrosshair, drawDraft, drawFailure, drawGoal, drawSelection } from "./overlay.js";
import { numberText } from "./view.js";

const SLIP = 4; // px: less is a click and no drag

export class Editor {
  constructor({ canvas, view, store, say, changed }) {
    Object.assign(this, { canvas, view, store, say, changed });
    this.tool = "select";
    this.options = { corridor: 200, wall: 40, pillar: "circle", polygon: "wall", snap: true };
    this.points = []; // of the draft
    this.next = null; // where the pointer is
    this.cursor = null; // the crosshair of the keyboard
    this.selected = -1;
    this.corner = null; // of the selected shape
    this.grab = null;
    this.press = null;
    this.failures = [];
    this.linkLength = 0;
    this.pointers = new Map();
    this.space = false;
    view.painters.push((context) => this.paint(context));
    this.listen();
  }

  paint(context) {
    const { view } = this;
    drawGoal(context, view, this.tool);
    drawBase(context, view, this.tool, this.linkLength);
    if (this.selected >= 0) drawSelection(context, view, this.selected);
    const tool = DRAWING[this.tool];
    if (tool) drawDraft(context, view, { tool, points: this.points, next: this.next, options: this.options });
    for (const failure of this.failures) drawFailure(context, view, failure);
    if (this.cursor && document.activeElement === this.canvas) drawCrosshair(context, view, this.cursor, Boolean(this.grab));
  }

  setTool(name) {
    this.cancel();
    this.tool = name;
    if (name !== "select") this.selectShape(-1);
    this.canvas.dataset.tool = name;
    this.say((DRAWING[name] ?? MOVING[name]).hint);
    this.changed();
    this.view.redraw();
  }
  selectShape(number, corner = null) {
    this.selected = number;
    this.corner = corner;
    this.changed();
    this.view.redraw();
  }
  /** Forget what belongs to the scene before. */
  reset() {
    this.cancel();
    this.cursor = null;
    this.selectShape(-1);
  }

  // Places

  snapped(place) {
    const step = this.view.gridStep, within = (value) => Math.min(Math.max(value, -EDGE), EDGE);
    return place.map((value) => tidy(within(this.options.snap ? Math.round(value / step) * step : value)));
  }
  placeOf(event, straight = event.shiftKey) {
    const box = this.canvas.getBoundingClientRect();
    const exact = this.view.toWorld(event.clientX - box.left, event.clientY - box.top), place = this.snapped(exact);
    const last = this.points[this.points.length - 1];
    return { exact, place: straight && last ? straightened(last, place) : place };
  }
  apart(a, b) { return Math.hypot(a[0] - b[0], a[1] - b[1]) * this.view.scale; }

  // Drawing

  addPoint(place) {
    const tool = DRAWING[this.tool], { points } = this;
    const last = points[points.length - 1];
    if (last && this.apart(last, place) < SLIP) return this.finish();
    if (tool.closed && points.length >= tool.least && this.apart(points[0], place) < 10) return this.finish();
    points.push(place);
    this.next = null;
    if (points.length === tool.most) return this.finish();
    this.say(`${tool.name}: point ${points.length} at ${numberText(place[0])}, ${numberText(place[1])}.`);
    this.changed();
    return this.view.redraw();
  }
  finish() {
    const tool = DRAWING[this.tool], { points } = this;
    if (!tool || !points.length) return;
    this.points = [];
    this.next = null;
    const shape = points.length >= tool.least ? tool.build(points, this.options) : null;
    if (shape) {
      this.store.change({ shapes: [...this.store.scene.shapes, shape] });
      this.say(`${shapeName(this.store.scene, this.store.scene.shapes.length - 1)} is drawn.`);
    } else this.say(`${tool.name}: too small, nothing was drawn.`);
    this.changed();
    this.view.redraw();
  }
  backPoint() {
    this.points.pop();
    this.changed();
    this.view.redraw();
  }
  /** End what is being done, without doing it. Returns whether there was anything. */
  cancel() {
    const busy = this.points.length > 0 || this.grab !== null;
    if (this.grab) this.store.putBack();
    Object.assign(this, { points: [], next: null, grab: null, press: null });
    if (busy) this.say("Cancelled.");
    this.changed();
    this.view.redraw();
    return busy;
  }

  // Moving

  take(place, pickedByKey = false) {
    const only = this.tool === "base" || this.tool === "goal" ? this.tool : null;
    this.grab = grabAt(this.store.scene, place, { scale: this.view.scale, selected: this.selected, only });
    if (!this.grab && only) { // nothing there yet: it is set here
      const at = this.snapped(place), { scene } = this.store;
      const part = only === "base" ? { base: [...at, scene.base ? scene.base[2] : 90] } : { goal: at };
      this.store.hold();
      this.store.change(part);
      this.say(`The ${only} is at ${numberText(at[0])}, ${numberText(at[1])}.`);
      if (pickedByKey) { this.store.drop(); return; }
      this.grab = grabAt(this.store.scene, at, { scale: this.view.scale, selected: -1, only, reach: 1 });
    }
    if (!this.grab) {
      this.selectShape(-1);
      if (pickedByKey) this.say("There is nothing to pick up here.");
      return;
    }
    this.selectShape(this.grab.select, this.grab.corner ?? null);
    this.grab.byKey = pickedByKey;
    if (this.store.held === null) this.store.hold();
    if (pickedByKey) this.say(`Picked up ${this.grab.name}: arrows move it, Enter drops it, Escape puts it back.`);
  }
  moveTo(exact, free = false) {
    const { grab } = this, from = grab.at;
    let to = grab.smooth ? exact : this.snapped(exact);
    if (grab.kind === "shape") {
      const by = this.snapped([exact[0] - from[0], exact[1] - from[1]]);
      to = [from[0] + by[0], from[1] + by[1]];
    }
    this.store.scene = grab.apply(grab.base ??= this.store.scene, to, free);
    this.store.tell();
  }
  drop() {
    const { grab } = this;
    this.grab = null;
    this.store.drop();
    if (grab.byKey) this.say(`Dropped ${grab.name}.`);
    this.changed();
    this.view.redraw();
  }
  remove() {
    const { scene } = this.store, shape = scene.shapes[this.selected];
    if (!shape) return this.say("Nothing is selected.");
    if (this.grab) this.cancel();
    const less = this.corner ? withoutCorner(shape, this.corner) : null;
    const name = less ? `corner ${this.corner.k + 1}` : shapeName(scene, this.selected);
    if (less) this.store.changeShape(this.selected, less);
    else this.store.change({ shapes: scene.shapes.filter((_, k) => k !== this.selected) });
    this.selectShape(less ? this.selected : -1);
    return this.say(`${name} is removed.`);
  }

  // Mouse and touch

  listen() {
    const { canvas } = this;
    const on = (name, action, options) => canvas.addEventListener(name, action, options);
    on("pointerdown", (event) => this.onDown(event));
    on("pointermove", (event) => this.onMove(event));
    on("pointerup", (event) => this.onUp(event));
    on("pointercancel", (event) => { this.onUp(event, true); });
    on("pointerleave", () => { if (!this.pointers.size) { this.next = null; this.view.redraw(); } });
    on("contextmenu", (event) => { if (this.points.length) event.preventDefault(); });
    on("wheel", (event) => {
      event.preventDefault();
      const box = canvas.getBoundingClientRect(), pixels = event.deltaY * (event.deltaMode === 1 ? 16 : 1);
      this.view.zoomBy(Math.exp(-Math.max(-200, Math.min(pixels, 200)) / 300), event.clientX - box.left, event.clientY - box.top);
    }, { passive: false });
    on("keydown", (event) => this.onKey(event));
    on("keyup", (event) => { if (event.key === " ") this.space = false; });
    on("focus", () => this.view.redraw());
    on("blur", () => { this.space = false; this.view.redraw(); });
  }

  onDown(event) {
    this.canvas.focus({ preventScroll: true });
    this.canvas.setPointerCapture(event.pointerId);
    this.pointers.set(event.pointerId, [event.clientX, event.clientY]);
    this.cursor = null;
    if (this.pointers.size > 1) { // two fingers: the view; what one finger began is undone
      if (this.press?.mode === "hold" && this.grab) this.store.putBack();
      this.grab = null;
      this.press = { mode: "view" };
      this.next = null;
      return;
    }
    if (event.button > 1) return;
    if (event.button === 1 || this.tool === "pan" || this.space) {
      this.press = { mode: "view" };
      return;
    }
    const { exact, place } = this.placeOf(event);
    this.press = { mode: "set", at: [event.clientX, event.clientY], exact, place, slipped: false };
    if (DRAWING[this.tool]) this.next = place;
    else {
      this.press.mode = "hold";
      this.take(exact);
    }
    this.view.redraw();
  }

  onMove(event) {
    const before = this.pointers.get(event.pointerId), now = [event.clientX, event.clientY];
    if (!before) { // a mouse that is not pressed
      if (DRAWING[this.tool] && this.points.length) { this.next = this.placeOf(event).place; this.view.redraw(); }
      return;
    }
    this.pointers.set(event.pointerId, now);
    const { press } = this;
    if (!press) return;
    if (press.mode === "view") {
      this.pinch(event.pointerId, before, now);
      return;
    }
    if (Math.hypot(now[0] - press.at[0], now[1] - press.at[1]) > SLIP) press.slipped = true;
    const { exact, place } = this.placeOf(event);
    if (press.mode === "hold") {
      if (this.grab && press.slipped) this.moveTo(exact, event.shiftKey);
    } else {
      this.next = place;
      if (press.slipped && !this.points.length && DRAWING[this.tool].most === 2) this.points = [press.place];
    }
    this.view.redraw();
  }
  pinch(id, before, now) {
    const other = [...this.pointers].find(([key]) => key !== id)?.[1];
    const share = other ? 0.5 : 1, box = this.canvas.getBoundingClientRect();
    this.view.panBy(share * (now[0] - before[0]), share * (now[1] - before[1]));
    if (!other) return;
    const wide = (a) => Math.hypot(a[0] - other[0], a[1] - other[1]);
    this.view.zoomBy(wide(now) / Math.max(wide(before), 1), (now[0] + other[0]) / 2 - box.left, (now[1] + other[1]) / 2 - box.top);
  }

  onUp(event, broken = false) {
    if (!this.pointers.delete(event.pointerId)) return;
    const { press } = this;
    if (press?.mode === "view") {
      if (!this.pointers.size) this.press = null;
      return;
    }
    this.press = null;
    if (!press) return;
    if (broken) { this.cancel(); return; }
    if (press.mode === "hold") { if (this.grab) this.drop(); return; }
    this.addPoint(this.placeOf(event).place);
    if (event.pointerType === "touch") this.next = null;
  }

  // Keys: a crosshair instead of the pointer

  onKey(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const arrows = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
    const step = this.view.gridStep * (event.shiftKey ? 10 : 1);
    if (arrows[event.key]) this.moveCursor(arrows[event.key].map((by) => by * step));
    else if (event.key === "Enter") this.enter();
    else if (event.key === "Delete" || event.key === "Backspace") { if (this.points.length) this.backPoint(); else this.remove(); }
    else if (event.key === " ") this.space = true;
    else if (event.key === "n" || event.key === "N") this.nextHandle(event.shiftKey ? -1 : 1);
    else if (event.key === "+" || event.key === "=") this.view.zoomBy(1.4);
    else if (event.key === "-") this.view.zoomBy(1 / 1.4);
    else return;
    event.preventDefault();
  }
  ensureCursor() {
    this.cursor ??= this.snapped([this.view.x, this.view.y]);
  }
  moveCursor([dx, dy]) {
    this.ensureCursor();
    if (this.grab?.kind === "turn") { // arrows turn it, by 5 or with shift by 50 degrees
      const step = Math.sign(dy || -dx) * (Math.hypot(dx, dy) > 2 * this.view.gridStep ? 50 : 5), [x, y, heading] = this.store.scene.base;
      this.store.scene = { ...this.store.scene, base: [x, y, tidy((heading + step) % 360)] };
      this.store.tell();
      this.say(`Heading ${numberText(this.store.scene.base[2])} degrees.`);
      return;
    }
    const at = [this.cursor[0] + dx, this.cursor[1] + dy];
    if (Math.max(...at.map(Math.abs)) > EDGE) return;
    this.cursor = at.map(tidy);
    if (this.grab) this.moveTo(this.cursor);
    if (this.points.length) this.next = this.cursor;
    this.view.reveal(...this.cursor);
    this.say(`${numberText(this.cursor[0])}, ${numberText(this.cursor[1])}`);
    this.view.redraw();
  }
  enter() {
    this.ensureCursor();
    if (DRAWING[this.tool]) this.addPoint(this.cursor);
    else if (this.grab) this.drop();
    else if (this.tool !== "pan") this.take(this.cursor, true);
    this.view.redraw();
  }
  /** Bring the crosshair to the next thing that can be picked up. */
  nextHandle(by) {
    const { scene } = this.store, shape = scene.shapes[this.selected];
    const middle = ({ line, rings }) => { const at = (line ?? rings[0])[0]; return { x: at[0], y: at[1] }; };
    const marks = [...marksOf(scene, this.view.scale), ...(shape ? handlesOf(shape).corners : []), ...scene.shapes.map(middle)];
    if (!marks.length || this.grab) return;
    this.handle = (((this.handle ?? -1) + by) % marks.length + marks.length) % marks.length;
    const mark = marks[this.handle];
    this.cursor = [mark.x, mark.y];
    this.view.reveal(mark.x, mark.y);
    this.say(`At ${mark.kind ?? "a corner"}: ${numberText(mark.x)}, ${numberText(mark.y)}. Enter picks up.`);
    this.view.redraw();
  }
}
