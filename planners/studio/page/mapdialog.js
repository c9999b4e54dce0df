// Read a map: what was understood is shown, and may be read again in another way, before anything is replaced.

import { job } from "./api.js";
import { EMPTY, boundsOf, checkedScene, pathOf, rounded, setPen, sizeOf } from "./scene.js";
import { element } from "./results.js";
import { colours, numberText } from "./view.js";

const byId = (id) => document.getElementById(id);
const ROLES = ["free", "walls", "base", "goal", "ignore"];

export class MapDialog {
  constructor() {
    this.dialog = byId("map-dialog");
    this.options = byId("map-options");
    byId("map-more").addEventListener("change", () => this.read());
    byId("map-layers").addEventListener("change", () => this.read());
    byId("map-cancel").addEventListener("click", () => this.dialog.close("cancel"));
  }

  /** Ask how a map is to be read. Returns the scene that is to be used, or null. */
  async ask(files) {
    this.files = files;
    this.scene = null;
    this.layers = {};
    this.options.closest("form").reset();
    byId("map-layers").replaceChildren();
    byId("map-title").textContent = `Read ${files.map((file) => file.name).join(", ")}`;
    this.dialog.returnValue = "";
    this.dialog.showModal();
    this.read();
    await new Promise((done) => this.dialog.addEventListener("close", done, { once: true }));
    this.control?.abort();
    return this.dialog.returnValue === "use" ? this.scene : null;
  }

  wishes() {
    const wishes = {};
    for (const field of this.options.querySelectorAll("input")) {
      if (field.type === "checkbox") wishes[field.name] = field.checked;
      else if (field.value.trim() !== "") wishes[field.name] = field.type === "number" ? Number(field.value) : field.value.trim();
    }
    const chosen = [...byId("map-layers").querySelectorAll("select")].filter((select) => select.dataset.touched);
    for (const role of ROLES) {
      const names = chosen.filter((select) => select.value === role).map((select) => select.name);
      if (names.length) wishes[role] = names;
    }
    return wishes;
  }

  async read() {
    this.control?.abort();
    const control = this.control = new AbortController();
    byId("map-use").disabled = true;
    this.dialog.dataset.reading = "1";
    try {
      const result = await job("/api/map", { files: this.files, options: this.wishes() }, { signal: control.signal });
      if (control !== this.control) return;
      this.take(result);
      byId("map-use").disabled = false;
      byId("map-problem").hidden = true;
    } catch (error) {
      if (control !== this.control || error.kind === "cancelled") return;
      byId("map-problem").hidden = false;
      byId("map-problem").textContent = error.message;
      byId("map-more").open = true;
    }
    delete this.dialog.dataset.reading;
  }

  take(result) {
    this.scene = sceneOfMap(result);
    const { units } = this.scene, notes = [...(result.notes ?? [])];
    if (result.moved > 0) notes.push(`Walls were moved into the free space by at most ${numberText(result.moved, 2)} ${units}, never out of it.`);
    if (result.parts > 1) notes.push(`The free space has ${result.parts} parts: the one with the base counts.`);
    byId("map-notes").replaceChildren(...notes.map((text) => element("li", { textContent: text })));
    this.showLayers(result.layers ?? {});
    this.draw();
  }
  showLayers(layers) {
    const names = Object.keys(layers), host = byId("map-layers");
    const touched = new Set([...host.querySelectorAll("select")].filter((select) => select.dataset.touched).map((select) => select.name));
    const roleOf = (role) => (role === "ignored" ? "ignore" : role === "wall" ? "walls" : role);
    host.replaceChildren(...(names.length ? [element("h3", { textContent: "Layers" })] : []), ...names.map((name) => {
      const select = element("select", { name, ariaLabel: `Role of ${name}` }, ...ROLES.map((role) => new Option(role, role)));
      select.value = roleOf(layers[name]);
      if (touched.has(name)) select.dataset.touched = "1";
      select.addEventListener("change", () => { select.dataset.touched = "1"; });
      return element("label", { className: "row" }, element("span", { textContent: name }), select);
    }));
  }

  draw() {
    const canvas = byId("map-preview"), context = canvas.getContext("2d"), ratio = window.devicePixelRatio || 1;
    canvas.width = canvas.clientWidth * ratio;
    canvas.height = canvas.clientHeight * ratio;
    const { x0, x1, y0, y1 } = boundsOf(this.scene), origin = [x0, y0];
    const s = 0.92 * Math.min(canvas.width / (x1 - x0 || 1), canvas.height / (y1 - y0 || 1));
    context.fillStyle = colours.wall;
    context.fillRect(0, 0, canvas.width, canvas.height);
    context.setTransform(s, 0, 0, -s, (canvas.width - s * (x1 - x0)) / 2, (canvas.height + s * (y1 - y0)) / 2);
    for (const shape of this.scene.shapes) {
      context.fillStyle = context.strokeStyle = shape.role === "free" ? colours.free : colours.wall;
      if (shape.line) {
        setPen(context, shape.width);
        context.stroke(pathOf(shape, origin));
      } else {
        context.fill(pathOf(shape, origin), "evenodd");
        context.strokeStyle = colours.edge;
        context.lineWidth = ratio / s;
        context.stroke(pathOf(shape, origin));
      }
    }
    for (const [place, colour] of [[this.scene.base, colours.base], [this.scene.goal, colours.goal]]) {
      if (!place) continue;
      context.fillStyle = colour;
      context.beginPath();
      context.arc(place[0] - x0, place[1] - y0, 6 * ratio / s, 0, 2 * Math.PI);
      context.fill();
    }
  }
}

/** A map may say neither base nor goal: they are then to be set on the canvas. */
function sceneOfMap(result) {
  const found = checkedScene({ ...EMPTY, ...result.scene, units: result.units ?? result.scene.units, goal_radius: result.scene.goal_radius ?? null });
  if (!result.scene.goal_radius) found.goal_radius = rounded(sizeOf({ ...found, goal: null }) / 60);
  return found;
}
