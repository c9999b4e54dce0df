// The buttons of the tools, and the fields that belong to a tool or to what is selected.

import { DRAWING, MOVING } from "./tools.js";
import { element } from "./results.js";
import { tidy } from "./scene.js";

const byId = (id) => document.getElementById(id);
const ORDER = ["select", "corridor", "room", "polygon", "wall", "pillar", "base", "goal", "pan"];
const HELP = [
  ["Arrows", "move the crosshair on the canvas, with Shift by ten steps"], ["Enter", "sets a point; picks up and drops base, goal, corners, shapes"],
  ["N", "brings the crosshair to the next thing"], ["Delete", "removes what is selected, or the last point"], ["Esc", "ends what is begun; cancels planning; back to the drawing"],
  ["Shift", "while drawing: multiples of 45 degrees"], ["Space", "with a drag: moves the view; in Watch: play"], ["+ \u2212 F", "zoom, fit"], ["S", "snap to the grid"],
  ["Ctrl-Enter", "plan"], ["Ctrl-Z, Ctrl-Y", "undo, redo"], ["Ctrl-S, Ctrl-O", "save, open"],
];

export function buildTools(editor, store, { undo, redo }) {
  const tools = { ...MOVING, ...DRAWING };
  byId("tools").replaceChildren(...ORDER.map((name) => {
    const tool = tools[name], letter = tool.key.toUpperCase();
    const button = element("button", { type: "button", title: `${tool.name} (${letter})`, innerHTML: `<svg><use href="#i-${name}"/></svg><span>${tool.name.split(" ")[0]}</span>` });
    button.dataset.tool = name;
    button.dataset.key = tool.key;
    button.setAttribute("aria-keyshortcuts", letter);
    button.addEventListener("click", () => { editor.setTool(name); editor.canvas.focus({ preventScroll: true }); });
    return button;
  }));
  byId("keys").replaceChildren(...[...ORDER.map((name) => [tools[name].key.toUpperCase(), tools[name].name.toLowerCase()]), ...HELP]
    .flatMap(([key, text]) => [element("dt", { textContent: key }), element("dd", { textContent: text })]));
  const click = (id, action) => byId(id).addEventListener("click", action);
  click("undo", undo);
  click("redo", redo);
  click("finish", () => editor.finish());
  click("back-point", () => editor.backPoint());
  click("drop-draft", () => editor.cancel());
  click("remove", () => editor.remove());
  click("snap", () => { editor.options.snap = !editor.options.snap; showTools(editor, store); });
  click("zoom-in", () => editor.view.zoomBy(1.5));
  click("zoom-out", () => editor.view.zoomBy(1 / 1.5));
  click("zoom-fit", () => editor.view.fit());
  listenToFields(editor, store);
}

function listenToFields(editor, store) {
  const change = (id, action) => byId(id).addEventListener("change", (event) => {
    action(event.target.value);
    showTools(editor, store);
  });
  const positive = (text, act) => { if (Number(text) > 0 && Number(text) < 1e9) act(Number(text)); };
  change("shape-width", (text) => positive(text, (width) => {
    const shape = store.scene.shapes[editor.selected];
    if (shape) store.changeShape(editor.selected, { ...shape, width });
    else editor.options[DRAWING[editor.tool]?.width] = width;
  }));
  change("pillar-form", (form) => { editor.options.pillar = form; });
  change("polygon-role", (role) => { editor.options.polygon = role; });
  change("shape-role", (role) => store.changeShape(editor.selected, { ...store.scene.shapes[editor.selected], role }));
  change("goal-radius", (text) => positive(text, (radius) => store.change({ goal_radius: radius })));
  change("base-heading", (text) => {
    const heading = Number(text), { base } = store.scene;
    if (text.trim() !== "" && Number.isFinite(heading) && base) store.change({ base: [base[0], base[1], tidy(heading % 360)] });
  });
}

/** Show which tool is chosen, and its fields. */
export function showTools(editor, store) {
  const { scene } = store, { tool, options, points } = editor, shape = scene.shapes[editor.selected];
  for (const button of byId("tools").children) button.setAttribute("aria-pressed", String(button.dataset.tool === tool));
  const show = (name, shown) => document.querySelectorAll(`.for-${name}`).forEach((part) => { part.hidden = !shown; });
  const width = DRAWING[tool]?.width;
  show("width", Boolean(width) || Boolean(shape?.line));
  show("pillar", tool === "pillar");
  show("polygon", tool === "polygon");
  show("shape", Boolean(shape));
  show("goal", tool === "goal" && Boolean(scene.goal));
  show("base", tool === "base" && Boolean(scene.base));
  show("draft", points.length > 0);
  const put = (id, value) => { if (document.activeElement !== byId(id) || byId(id) instanceof HTMLSelectElement) byId(id).value = value; };
  put("shape-width", shape?.line ? shape.width : options[width] ?? "");
  put("goal-radius", scene.goal_radius);
  put("base-heading", scene.base ? scene.base[2] : "");
  put("pillar-form", options.pillar);
  put("polygon-role", options.polygon);
  if (shape) put("shape-role", shape.role);
  byId("snap").setAttribute("aria-pressed", String(options.snap));
  byId("undo").disabled = !store.past.length;
  byId("redo").disabled = !store.future.length;
}
