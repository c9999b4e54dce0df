// The settings: what the arm is, and who plans. Fields hold text; `arm()` and `budget()` say what it means.

import { faultsOf, rounded, sizeOf } from "./scene.js";

const byId = (id) => document.getElementById(id);
const FIELDS = ["link-length", "n-links", "link-radius", "joint-limit", "planner", "second", "budget"];

export class Panel {
  constructor({ store, editor, changed }) {
    Object.assign(this, { store, editor, changed, planners: [] });
    for (const id of FIELDS) byId(id).addEventListener("input", () => this.edited(id));
    byId("link-slider").addEventListener("input", () => {
      byId("link-length").value = rounded3(this.lengthAt(Number(byId("link-slider").value) / 1000));
      this.edited("link-slider");
    });
    const rename = (id, key, otherwise) => byId(id).addEventListener("change", (event) => {
      this.store.change({ [key]: event.target.value.trim() || otherwise });
    });
    rename("scene-name", "name", "maze");
    rename("scene-units", "units", "px");
  }

  offer(planners, limits) {
    this.planners = planners;
    const option = (value, text) => new Option(text, value);
    byId("planner").replaceChildren(...planners.map(({ name }) => option(name, name)));
    byId("second").replaceChildren(option("", "nothing"), ...planners.map(({ name }) => option(name, name)));
    this.mostBudget = limits?.time_budget_s ?? 60;
    byId("budget").max = this.mostBudget;
    this.set({ budget: Math.min(20, this.mostBudget) });
    this.edited("planner");
  }

  number(id) {
    const field = byId(id), text = field.value.trim();
    if (field.validity.badInput) return NaN;
    return text === "" ? null : Number(text);
  }

  /** The arm as the server takes it; throws one sentence for what is no arm. */
  arm() {
    const length = this.number("link-length"), links = this.number("n-links");
    const radius = this.number("link-radius") ?? 0, limit = this.number("joint-limit");
    if (!(length > 0)) throw new Error("Give the link length: a number over 0.");
    if (links !== null && !(Number.isInteger(links) && links > 0)) throw new Error("Links: a whole number over 0, or nothing for as many as are needed.");
    if (!(radius >= 0)) throw new Error("Link radius: a number of at least 0.");
    if (limit !== null && !(limit > 0 && limit <= 180)) throw new Error("Joint limit: degrees over 0 up to 180, or nothing for none.");
    return { link_length: length, n_links: links, link_radius: radius, joint_limit_deg: limit };
  }
  budget() {
    const budget = this.number("budget");
    if (!(budget > 0)) throw new Error("Time budget: seconds over 0.");
    return Math.min(budget, this.mostBudget);
  }
  get planner() { return byId("planner").value; }
  get second() { return byId("second").value; }

  /** What a file remembers of the settings. */
  settings() {
    const text = (id) => byId(id).value;
    return {
      link_length: text("link-length"), n_links: text("n-links"), link_radius: text("link-radius"), joint_limit: text("joint-limit"),
      planner: text("planner"), second: text("second"), budget: text("budget"),
    };
  }
  set(settings) {
    const into = {
      link_length: "link-length", n_links: "n-links", link_radius: "link-radius", joint_limit: "joint-limit", planner: "planner",
      second: "second", budget: "budget",
    };
    for (const [key, id] of Object.entries(into)) {
      const value = settings?.[key];
      if (typeof value !== "string" && typeof value !== "number") continue;
      const field = byId(id);
      if (field instanceof HTMLSelectElement && ![...field.options].some((option) => option.value === String(value))) continue;
      field.value = value;
    }
    this.edited("all");
  }

  edited(id) {
    const about = this.planners.find(({ name }) => name === this.planner)?.about ?? "";
    byId("planner-about").textContent = about;
    byId("plan").textContent = this.second ? "Plan both" : "Plan";
    this.editor.linkLength = this.number("link-length") || 0;
    this.editor.view.redraw();
    this.check();
    if (id !== "link-slider") this.placeSlider();
    this.changed();
  }

  // The slider: equal factors, from a hundredth of the maze to its whole.
  lengthAt(share) {
    const size = sizeOf(this.store.scene);
    return size / 100 * 100 ** share;
  }
  placeSlider() {
    const length = this.number("link-length");
    if (!(length > 0)) return;
    const share = Math.log(length / this.lengthAt(0)) / Math.log(100);
    byId("link-slider").value = 1000 * Math.min(Math.max(share, 0), 1);
    byId("link-slider").setAttribute("aria-valuetext", `${length} ${this.store.scene.units}`);
  }

  /** Show the scene's own fields, and what cannot be planned yet. */
  show(scene) {
    const put = (id, text) => { if (document.activeElement !== byId(id)) byId(id).value = text; };
    put("scene-name", scene.name);
    put("scene-units", scene.units);
    for (const mark of document.querySelectorAll(".units")) mark.textContent = scene.units;
    this.placeSlider();
    clearTimeout(this.checkLater);
    this.checkLater = setTimeout(() => this.check(), 120);
  }
  check() {
    const faults = faultsOf(this.store.scene, this.number("link-length"));
    let problem = null;
    try { this.arm(); } catch (error) { problem = error.message; }
    byId("hints").replaceChildren(...[...(problem ? [problem] : []), ...faults].map((text) => {
      const item = document.createElement("li");
      item.textContent = text;
      return item;
    }));
  }
}

function rounded3(value) { return Number(value.toPrecision(3)); }
