// Export a run, or the maze, in a format that the server writes.

import { download, job } from "./api.js";
import { fileName } from "./files.js";

const byId = (id) => document.getElementById(id);
const PLAIN = new Set(["geojson"]); // of the maze alone
const UNTIMED = new Set(["geojson", "html", "motion"]);

export class Exporter {
  constructor({ runs, scene, arm, fail, say }) {
    Object.assign(this, { runs, scene, arm, fail, say, control: null });
    this.dialog = byId("export-dialog");
    byId("export-format").addEventListener("change", () => this.chosen());
    byId("export-run").addEventListener("change", () => this.offerBeside());
    byId("export-cancel").addEventListener("click", () => this.dialog.close());
    this.dialog.addEventListener("close", () => this.control?.abort());
    this.dialog.querySelector("form").addEventListener("submit", (event) => {
      event.preventDefault();
      this.go();
    });
  }
  offer(formats) { this.formats = formats; }

  open(first, second) {
    const { list } = this.runs;
    const pairs = first && second ? [new Option(`${first.title}, beside ${second.title}`, `${first.id},${second.id}`)] : [];
    byId("export-run").replaceChildren(...pairs, ...list.map((run) => new Option(run.title, run.id, false, run === first && !second)), new Option("the maze alone", ""));
    this.offerBeside();
    byId("export-problem").hidden = true;
    byId("export-progress").textContent = "";
    this.dialog.showModal();
  }
  get chosenRuns() {
    return byId("export-run").value.split(",").map((id) => this.runs.list.find((run) => String(run.id) === id)).filter(Boolean);
  }
  offerBeside() {
    const number = this.chosenRuns.length, before = byId("export-format").value;
    const fits = ({ name }) => (number === 0 ? PLAIN.has(name) : number === 2 ? name === "html" : true);
    byId("export-format").replaceChildren(...(this.formats ?? []).filter(fits).map(({ name, ending }) => new Option(`${name} (${ending})`, name, false, name === before)));
    this.chosen();
  }
  chosen() {
    const format = this.formats?.find(({ name }) => name === byId("export-format").value);
    byId("export-about").textContent = format?.about ?? "";
    byId("export-options").hidden = !format || UNTIMED.has(format.name);
    byId("export-go").disabled = !format;
  }

  body() {
    const value = (name) => {
      const field = this.dialog.querySelector(`[name=${name}]`), label = field.closest("label").textContent.trim();
      if (field.validity.badInput || (field.value.trim() !== "" && !(Number(field.value) > 0))) throw new Error(`${label}: a number over 0, or nothing.`);
      return field.value.trim() === "" ? null : Number(field.value);
    };
    const limits = {};
    for (const [name, factor] of [["joint_speed", Math.PI / 180], ["joint_acceleration", Math.PI / 180], ["feed_speed", 1], ["feed_acceleration", 1]])
      if (value(name) !== null) limits[name] = value(name) * factor;
    const runs = this.chosenRuns.map(({ scene, arm, motion, title, result }) => ({ scene, arm: { ...arm, n_links: result.n_links }, motion, title }));
    if (!runs.length) runs.push({ scene: this.scene(), arm: this.arm(), motion: null, title: "" });
    return { format: byId("export-format").value, runs, rate: value("rate"), limits, metres_per_unit: value("metres_per_unit") };
  }

  async go() {
    if (this.control) return;
    byId("export-problem").hidden = true;
    byId("export-go").disabled = true;
    this.control = new AbortController();
    try {
      const body = this.body();
      byId("export-progress").textContent = "Writing\u2026";
      const heard = (line) => { if (line.type === "progress" && line.stage) byId("export-progress").textContent = `${line.stage}, ${Math.round(100 * (line.share ?? 0))} %`; };
      const { name, type, data } = await job("/api/export", body, { signal: this.control.signal, heard });
      const bytes = Uint8Array.from(atob(data), (letter) => letter.charCodeAt(0));
      const given = name || fileName(body.runs[0].scene.name, "");
      download(given, bytes, type);
      byId("export-progress").textContent = `${given} is written, ${(bytes.length / 1024).toFixed(0)} KiB.`;
      this.say(`${given} is downloaded.`);
    } catch (error) {
      byId("export-progress").textContent = "";
      if (error.kind === "cancelled") return;
      byId("export-problem").hidden = false;
      byId("export-problem").textContent = error.message.replace(/ \(--[a-z-]+ [\d.]+\)/, ""); // an option of the command line
      byId("export-problem").scrollIntoView({ block: "nearest" });
    } finally {
      this.control = null;
      byId("export-go").disabled = false;
    }
  }
}
