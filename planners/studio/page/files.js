// Files of one's own: save and open, autosave, drag and drop.

import { base64Of, download } from "./api.js";
import { checkedScene } from "./scene.js";

const byId = (id) => document.getElementById(id);
const ENDING = ".hrsnake.json", KEPT = "hrsnake-studio", MAX_FILES = 8;

export function fileName(name, ending) {
  return `${name.trim().replace(/[^\p{L}\p{N}._-]+/gu, "-").replace(/^[-.]+|-+$/g, "").slice(0, 60) || "maze"}${ending}`;
}

/** All of a studio as plain data. A run of an earlier drawing brings its own. */
export function packed(scene, settings, runs) {
  return {
    hrsnake: 1, scene, settings,
    runs: runs.list.map((run) => ({
      title: run.title, planner: run.planner, arm: run.arm, motion: run.motion, ...(runs.isOld(run) ? { scene: run.scene } : {}),
    })),
  };
}

export function save(scene, settings, runs) {
  const name = fileName(scene.name, ENDING);
  download(name, JSON.stringify(packed(scene, settings, runs)), "application/json");
  return name;
}

/** Read a saved file: {scene, settings, runs}; throws one sentence. */
export function unpacked(text) {
  let data;
  try { data = JSON.parse(text); } catch { throw new Error("Expected a file that the studio has saved, got one that is no JSON."); }
  if (data === null || typeof data !== "object" || data.hrsnake !== 1) throw new Error("Expected a file that the studio has saved, got another one.");
  const runs = (Array.isArray(data.runs) ? data.runs : []).map((run, number) => {
    if (run === null || typeof run !== "object" || typeof run.motion !== "string" || run.arm === null || typeof run.arm !== "object")
      throw new Error(`Expected runs with an arm and a motion, but run ${number + 1} has none.`);
    const text = (value, otherwise) => (typeof value === "string" ? value.slice(0, 200) : otherwise);
    return { title: text(run.title, `run ${number + 1}`), planner: text(run.planner, ""), arm: run.arm, motion: run.motion, scene: run.scene ? checkedScene(run.scene) : null };
  });
  return { scene: checkedScene(data.scene), settings: data.settings ?? {}, runs };
}

/** Keep the drawing in the browser, so that a closed tab loses nothing. */
export function keep(scene, settings) {
  try { localStorage.setItem(KEPT, JSON.stringify({ scene, settings })); } catch { /* no room, or not allowed */ }
}
export function kept() {
  try {
    const data = JSON.parse(localStorage.getItem(KEPT));
    return data ? { scene: checkedScene(data.scene), settings: data.settings ?? {} } : null;
  } catch {
    return null;
  }
}

/** Sort what was chosen or dropped: a saved file, or the files of one map. */
export async function sorted(list, limits) {
  const files = [...list];
  if (!files.length) return null;
  const most = limits?.body_bytes ?? 48 * 2 ** 20;
  if (files.reduce((sum, file) => sum + file.size, 0) * 4 / 3 > most) throw new Error(`Expected files of at most ${Math.floor(most * 0.75 / 2 ** 20)} MiB in all.`);
  const saved = files.find((file) => file.name.toLowerCase().endsWith(ENDING));
  if (saved) return { saved: unpacked(await saved.text()) };
  if (files.length === 1 && files[0].name.toLowerCase().endsWith(".json")) {
    const text = await files[0].text();
    let data = null;
    try { data = JSON.parse(text); } catch { data = null; }
    if (data?.hrsnake !== undefined) return { saved: unpacked(text) };
  }
  if (files.length > MAX_FILES) throw new Error(`Expected at most ${MAX_FILES} files for one map, got ${files.length}.`);
  const read = async (file) => ({ name: file.name.slice(0, 200), data: base64Of(new Uint8Array(await file.arrayBuffer())) });
  return { map: await Promise.all(files.map(read)) };
}

export function listenForFiles(take, fail) {
  const input = byId("file"), zone = document.querySelector(".dropzone");
  input.addEventListener("change", async () => {
    const files = [...input.files];
    input.value = ""; // the same file again is a change, too
    await take(files).catch((error) => fail(error.message));
  });
  byId("pick-file").addEventListener("click", () => input.click());
  let depth = 0;
  const hasFiles = (event) => [...(event.dataTransfer?.types ?? [])].includes("Files");
  window.addEventListener("dragenter", (event) => { if (hasFiles(event)) { depth += 1; zone.hidden = false; } });
  window.addEventListener("dragleave", () => { depth = Math.max(0, depth - 1); zone.hidden = depth === 0; });
  window.addEventListener("dragover", (event) => { if (hasFiles(event)) event.preventDefault(); });
  window.addEventListener("drop", async (event) => {
    depth = 0;
    zone.hidden = true;
    if (!hasFiles(event)) return;
    event.preventDefault();
    await take([...event.dataTransfer.files]).catch((error) => fail(error.message));
  });
}
