// What belongs together: scene, canvas, settings, jobs, runs; buttons and keys.

import { ApiError, get } from "./api.js";
import { Editor } from "./editor.js";
import { Exporter } from "./exporter.js";
import { keep, kept, listenForFiles, save, sorted } from "./files.js";
import { MapDialog } from "./mapdialog.js";
import { Panel } from "./panel.js";
import { Runs, element, longestCard, outcomeCard } from "./results.js";
import { EMPTY, START, START_LINK, Store, checkedScene, rounded, sizeOf } from "./scene.js";
import { buildTools, showTools } from "./toolbar.js";
import { View, numberText, readColours } from "./view.js";
import { Watch } from "./watch.js";
import { Work } from "./work.js";

const root = document.documentElement;
const byId = (id) => document.getElementById(id);

function say(text) { byId("status").textContent = text; }
function fail(message) {
  byId("alert-text").textContent = message;
  byId("alert").hidden = false;
}
window.addEventListener("error", (event) => { root.dataset.errors += event.message + "\n"; fail(`Something went wrong on this page: ${event.message}`); });
window.addEventListener("unhandledrejection", (event) => { root.dataset.errors += String(event.reason) + "\n"; fail(`Something went wrong on this page: ${event.reason?.message ?? event.reason}`); });

readColours();
const store = new Store(START);
const view = new View(byId("canvas"));
const editor = new Editor({ canvas: byId("canvas"), view, store, say, changed: () => showTools(editor, store) });
const panel = new Panel({ store, editor, changed: () => remember() });
const work = new Work({ fail });
const runs = new Runs({ store, watch: (chosen) => watchRuns(chosen), changed: () => { byId("tab-watch").disabled = !runs.list.length; } });
const watch = new Watch({ runs, fail });
const exporter = new Exporter({ runs, scene: () => store.scene, arm: () => panel.arm(), fail, say });
const maps = new MapDialog();
const about = { planners: [], mazes: [], exports: [], map_endings: [], limits: {}, start: null };

let later = 0;
function remember() {
  clearTimeout(later);
  later = setTimeout(() => keep(store.scene, panel.settings()), 250);
}
addEventListener("pagehide", () => keep(store.scene, panel.settings()));

store.listen((scene) => {
  if (editor.selected >= scene.shapes.length) editor.selectShape(-1);
  editor.failures = [];
  view.show(scene);
  panel.show(scene);
  showTools(editor, store);
  runs.refresh();
  remember();
});

const settingsOf = new WeakMap(); // of scenes that replaced another: they come back together

/** Another drawing: the one before comes back with undo. */
function replaceScene(scene, settings) {
  editor.reset();
  settingsOf.set(store.scene, panel.settings());
  store.set({ ...scene });
  setView("draw");
  view.fit();
  const wide = sizeOf(scene);
  Object.assign(editor.options, { corridor: rounded(wide / 9), wall: rounded(wide / 45) });
  if (settings) panel.set(settings);
  settingsOf.set(store.scene, panel.settings());
  byId("outcomes").replaceChildren();
  showTools(editor, store);
}

function setView(name) {
  if (root.dataset.view === name) return;
  const left = byId(`${root.dataset.view}-view`).contains(document.activeElement); // the focus does not stay behind
  root.dataset.view = name;
  byId("draw-view").hidden = name !== "draw";
  byId("watch-view").hidden = name !== "watch";
  byId("tab-draw").setAttribute("aria-pressed", String(name === "draw"));
  byId("tab-watch").setAttribute("aria-pressed", String(name === "watch"));
  if (name === "draw") {
    watch.close();
    view.resize();
  }
  if (left) byId(name === "draw" ? "plan" : "player").focus({ preventScroll: true });
}
function watchRuns(chosen) {
  setView("watch");
  return watch.show(chosen.slice(0, 2));
}

// Jobs

function titleOf(scene, result, planner) {
  const length = result.length ?? panel.number("link-length");
  return `${scene.name}, ${result.n_links} links of ${numberText(length, 4)} ${scene.units}, ${result.planner || planner}`;
}
function markFailure(result, scene) {
  const text = result.longest_there ? `longest that passes: ${numberText(result.longest_there, 4)} ${scene.units}` : "";
  if (result.place || result.failure_joints) editor.failures.push({ place: result.place, joints: result.failure_joints, text });
  view.redraw();
}

async function plan() {
  if (work.busy) return;
  editor.finish();
  byId("alert").hidden = true;
  const { scene } = store;
  let arm, budget;
  try {
    arm = panel.arm();
    budget = panel.budget();
  } catch (error) { fail(error.message); return; }
  editor.failures = [];
  byId("outcomes").replaceChildren();
  const names = [panel.planner, ...(panel.second ? [panel.second] : [])];
  const found = await work.run("Planning", async (ask) => {
    const done = [];
    for (const planner of names) {
      const began = performance.now();
      const result = await ask("/api/plan", { scene, arm, planner, time_budget: budget }, names.length > 1 ? `Planning with ${planner}` : "Planning");
      done.push(answered({ planner, result, scene, arm, seconds: (performance.now() - began) / 1000 }));
    }
    return done;
  });
  const solved = (found ?? []).filter(Boolean);
  if (found && solved.length === names.length) watchRuns(solved);
  else if (found) byId("outcomes").scrollIntoView({ block: "nearest" });
}
/** Show an answer; returns its run if there is a motion. */
function answered({ planner, result, scene, arm, seconds }) {
  const run = result.motion && result.payload ? runs.add({ title: titleOf(scene, result, planner), planner, arm, scene, result }) : null;
  byId("outcomes").append(outcomeCard({ planner, result, scene, seconds, watch: run && (() => watchRuns([run])) }));
  if (!run && scene === store.scene) markFailure(result, scene);
  return run;
}

async function longest() {
  if (work.busy) return;
  editor.finish();
  byId("alert").hidden = true;
  const { scene } = store;
  let arm, budget;
  try {
    arm = { link_length: 1, n_links: null, link_radius: panel.number("link-radius") ?? 0, joint_limit_deg: panel.number("joint-limit") };
    budget = panel.budget();
  } catch (error) { fail(error.message); return; }
  const body = { scene, link_radius: arm.link_radius, joint_limit_deg: arm.joint_limit_deg, planner: panel.planner, accuracy: null, time_budget: budget };
  const result = await work.run("Longest link", (ask) => ask("/api/longest", body), { stoppable: true });
  if (!result) return;
  const run = result.motion && result.payload
    ? runs.add({ title: titleOf(scene, result, panel.planner), planner: result.planner, arm: { ...arm, link_length: result.length }, scene, result }) : null;
  const use = (length) => { panel.set({ link_length: shortened(length), n_links: "" }); byId("link-length").focus(); };
  byId("outcomes").replaceChildren(longestCard({ result, scene, use, watch: run && (() => watchRuns([run])) }));
  byId("outcomes").scrollIntoView({ block: "nearest" });
}
/** Six digits, rounded down: a rounded-up length may not pass. */
function shortened(length) {
  const factor = 10 ** (5 - Math.floor(Math.log10(length)));
  return Math.floor(length * factor + 1e-6) / factor;
}

// Files

async function take(files) {
  const found = await sorted(files, about.limits);
  if (!found) return;
  byId("open-dialog").close();
  byId("alert").hidden = true;
  if (found.map) {
    const scene = await maps.ask(found.map);
    if (!scene) return;
    replaceScene(scene, { link_length: rounded(sizeOf(scene) / 12), n_links: "" });
    if (!scene.base) { editor.setTool("base"); say("Click where the arm comes in: it must stand in the free space."); } else if (!scene.goal) editor.setTool("goal");
    return;
  }
  const { scene, settings, runs: motions } = found.saved;
  const checked = await work.run("Checking", async (ask) => {
    const done = [];
    for (const run of motions)
      done.push({ ...run, result: await ask("/api/check", { scene: run.scene ?? scene, arm: run.arm, motion: run.motion }, `Checking ${run.title}`) });
    return done;
  });
  if (!checked) return;
  replaceScene(scene, settings);
  const bad = checked.filter(({ result }) => !result.payload);
  for (const run of checked.filter(({ result }) => result.payload).reverse()) {
    run.result.planner ||= run.planner;
    runs.add({ title: run.title, planner: run.planner, arm: run.arm, scene: run.scene ?? store.scene, result: run.result });
  }
  if (bad.length) fail(`${bad.length === 1 ? "One run is" : `${bad.length} runs are`} not shown: ${bad[0].title}: ${bad[0].result.reason}`);
  say(`Opened ${scene.name}${checked.length ? `, ${checked.length - bad.length} of ${checked.length} runs checked` : ""}.`);
}

async function openMaze(name) {
  try {
    const { scene, link_length: length } = await get(`/api/mazes/${encodeURIComponent(name)}`);
    replaceScene(checkedScene(scene), { link_length: length, n_links: "" });
    byId("open-dialog").close();
    say(`Opened ${name}.`);
  } catch (error) {
    byId("open-dialog").close();
    fail(error.message);
  }
}
function newScene() {
  byId("open-dialog").close();
  replaceScene(EMPTY, { link_length: 200, n_links: "" });
  Object.assign(editor.options, { corridor: 100, wall: 20 });
  editor.setTool("corridor");
  say("An empty maze: all is wall. Draw a corridor, then set base and goal. Undo brings the old one back.");
}
function saveAll() { say(`Saved ${save(store.scene, panel.settings(), runs)}.`); }

// Buttons and keys

function listen() {
  const click = (id, action) => byId(id).addEventListener("click", action);
  byId("settings").addEventListener("submit", (event) => { event.preventDefault(); plan(); });
  click("longest", longest);
  click("tab-draw", () => setView("draw"));
  click("tab-watch", () => watchRuns(watch.shown.filter((run) => runs.list.includes(run)).length ? watch.shown : runs.list.slice(0, 1)));
  click("back", () => setView("draw"));
  click("open", () => byId("open-dialog").showModal());
  click("new-scene", newScene);
  click("save", saveAll);
  click("export", () => exporter.open(...(root.dataset.view === "watch" ? watch.shown : runs.list.slice(0, 1))));
  click("help", () => byId("help-dialog").showModal());
  click("alert-close", () => { byId("alert").hidden = true; });
  listenForFiles(take, (message) => { byId("open-dialog").close(); fail(message); });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { readColours(); view.redraw(); });
  new ResizeObserver(() => { if (view.resize()) view.fit(); }).observe(byId("canvas"));
  document.addEventListener("keydown", onKey);
}

const KEYS = {
  f: () => view.fit(), s: () => byId("snap").click(), d: () => setView("draw"), "?": () => byId("help-dialog").showModal(),
};
const CONTROL = {
  z: (event) => (event.shiftKey ? byId("redo") : byId("undo")).click(), y: () => byId("redo").click(), s: saveAll,
  o: () => byId("open-dialog").showModal(), Enter: plan,
};
function onKey(event) {
  if (document.querySelector("dialog[open]") || event.altKey || event.defaultPrevented) return;
  const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
  const writes = event.target.closest?.("select, textarea, input:not([type=range], [type=checkbox])");
  if (event.ctrlKey || event.metaKey) {
    if (!CONTROL[key] || (writes && "zy".includes(key))) return;
    event.preventDefault();
    CONTROL[key](event);
  } else if (key === "Escape") {
    if (work.busy) work.cancel();
    else if (root.dataset.view === "watch") setView("draw");
    else if (!editor.cancel() && editor.tool !== "select") editor.setTool("select");
  } else if (!writes && root.dataset.view === "watch") {
    if (key === "d") setView("draw");
  } else if (!writes) {
    const tool = document.querySelector(`#tools [data-key="${CSS.escape(key)}"]`);
    if (tool) tool.click();
    else KEYS[key]?.();
  }
}

// Start

async function start() {
  buildTools(editor, store, { undo: () => step("undo"), redo: () => step("redo") });
  listen();
  const old = kept();
  if (old) store.scene = old.scene;
  panel.set({ link_length: START_LINK, link_radius: 0 });
  view.resize();
  store.tell();
  view.fit();
  editor.setTool("select");
  try {
    Object.assign(about, await get("/api/about"));
    panel.offer(about.planners, about.limits);
    exporter.offer(about.exports);
    byId("endings").textContent = `A file saved here, or a map: ${about.map_endings.join(", ")}. A ROS map is its YAML and its image, chosen together. Files may be dropped on the page, too.`;
    byId("file").accept = [".json", ...about.map_endings].join(",");
    byId("mazes").replaceChildren(...about.mazes.map(({ name }) => element("li", {}, element("button", { type: "button", textContent: name, onclick: () => openMaze(name) }))));
  } catch (error) {
    fail(error instanceof ApiError ? error.message : String(error));
  }
  if (old) panel.set(old.settings);
  // What the command line was given is opened once: a reload shows what has been drawn since.
  const wanted = new URLSearchParams(location.search).get("maze") ?? (old ? null : about.start);
  if (wanted) await openMaze(wanted);
  history.replaceState(null, "", location.pathname);
  root.dataset.ready = "1";
}
function step(way) {
  editor.cancel();
  const done = store[way](), settings = settingsOf.get(store.scene);
  if (done && settings) {
    panel.set(settings);
    view.fit();
  }
  say(done ? `${way === "undo" ? "Undone" : "Done again"}.` : `Nothing to ${way}.`);
}

// For tests and the curious.
window.studio = { store, view, editor, panel, runs, watch, work };
start();
