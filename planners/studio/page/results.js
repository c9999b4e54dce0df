// What came of planning: a card for each answer, and the list of runs that can be watched.

import { numberText } from "./view.js";

const byId = (id) => document.getElementById(id);

export function element(tag, attributes = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) made.addEventListener(name.slice(2), value);
    else if (name in made && name !== "list") made[name] = value;
    else made.setAttribute(name, value);
  }
  made.append(...children.filter((child) => child !== null));
  return made;
}

const secondsText = (seconds) => (seconds >= 0.0995 ? `${seconds.toFixed(seconds < 10 ? 2 : 1)} s` : `${(1000 * seconds).toFixed(seconds < 0.01 ? 1 : 0)} ms`);

/** Words and colour of a result: what the simulator says of the motion that was found. */
function verdictOf(result) {
  if (!result.solved) return ["no motion", "bad"];
  const { verdict } = result;
  if (!verdict) return ["solved", "good"];
  return verdict.clean ? [verdict.pinch ? "clean, pinches" : "clean", "good"] : ["not clean", "bad"];
}

function verdictSentence(result, units) {
  const { verdict, report } = result, parts = [];
  if (verdict) {
    parts.push(verdict.clean ? (verdict.pinch ? `Links merely pinch the walls, in ${verdict.pinch} link-poses.` : "No link touches a wall.")
      : `Links go into walls in ${verdict.collision} link-poses, ${numberText(verdict.worst_depth, 3)} ${units} deep at worst.`);
  }
  if (report && typeof report.clearance === "number") parts.push(`Least clearance ${numberText(report.clearance, 3)} ${units}.`);
  return parts.join(" ");
}

function timingsOf(timings) {
  const entries = Object.entries(timings).filter(([, seconds]) => typeof seconds === "number" && seconds > 0);
  if (!entries.length) return null;
  const most = Math.max(...entries.map(([, seconds]) => seconds));
  return element("details", {}, element("summary", { textContent: "Time by stage" }),
    element("table", { className: "timings number" }, element("tbody", {}, ...entries.map(([stage, seconds]) =>
      element("tr", {}, element("th", { scope: "row", textContent: stage }),
        element("td", {}, element("meter", { value: seconds / most, title: stage })),
        element("td", { textContent: secondsText(seconds) }))))));
}

/** A card for a planner's answer. */
export function outcomeCard({ planner, result, scene, seconds, watch }) {
  const [word, tone] = verdictOf(result), { units } = scene;
  const title = result.planner && result.planner !== planner ? `${planner}: ${result.planner}` : planner;
  const head = element("header", {}, element("h3", { textContent: title }), element("span", { className: `chip ${tone}`, textContent: word }));
  const card = element("article", { className: `outcome ${tone}` }, head);
  if (!result.solved) {
    card.append(element("p", { role: "alert", textContent: result.reason || `No motion: ${result.status}.` }));
    if (result.longest_there) card.append(element("p", { textContent: `Longest link that passes there: ${numberText(result.longest_there, 4)} ${units}.` }));
  } else {
    const fact = (name, value) => element("div", {}, element("dt", { textContent: name }), element("dd", { textContent: value }));
    card.append(element("dl", { className: "facts number" }, fact("Planned in", secondsText(result.seconds)), fact("Links", String(result.n_links)),
      fact("Poses", String(result.n_poses))), element("p", { textContent: verdictSentence(result, units) }));
  }
  if (result.attempts?.length > 1) {
    card.append(element("details", {}, element("summary", { textContent: "What was tried" }),
      element("ul", {}, ...result.attempts.map((attempt) => element("li", { textContent: String(attempt) })))));
  }
  const timings = timingsOf(result.timings ?? {});
  if (timings) card.append(timings);
  card.append(element("p", { className: "small number", textContent: `Answered in ${secondsText(seconds)}.` }));
  if (watch) card.append(element("button", { type: "button", textContent: "Watch", onclick: watch }));
  return card;
}

/** A card for the longest link: the length, how sure it is, and what shorter ones need. */
export function longestCard({ result, scene, use, watch }) {
  const { units } = scene, digits = 4;
  const card = element("article", { className: `outcome ${result.length > 0 ? "good" : "bad"}` });
  const title = result.length > 0 ? `Longest link: ${numberText(result.length, digits)} ${units}` : "No length passes";
  card.append(element("header", {}, element("h3", { textContent: title })));
  const bound = result.bound_upper > 0 ? `No link over ${numberText(result.bound_upper, digits)} ${units} can pass, whatever the planner: this is ${(Math.floor(1000 * result.index + 1e-9) / 10).toFixed(1)} % of it.` : "";
  const rest = result.complete ? "" : " The search was stopped: there may be longer ones.";
  card.append(element("p", { textContent: `${bound}${rest} ${result.note ?? ""}`.trim() || "There is no way for any link." }));
  const rows = (result.table ?? []).filter((row) => row.link_length > 0);
  if (rows.length) {
    const cell = (text) => element("td", { textContent: text });
    card.append(element("div", { className: "scroll" }, element("table", { className: "lengths number" },
      element("thead", {}, element("tr", {}, ...[`Length, ${units}`, "Links", "Angle", ""].map((text) => element("th", { scope: "col", textContent: text })))),
      element("tbody", {}, ...rows.map((row) => {
        const solved = row.n_links !== null && row.n_links !== undefined;
        const length = numberText(row.link_length, digits);
        const button = element("button", { type: "button", textContent: "use", ariaLabel: `Use links of ${length} ${units}`, onclick: () => use(row.link_length) });
        return element("tr", { title: row.reason || "" }, cell(length), cell(solved ? String(row.n_links) : "\u2013"),
          cell(solved && row.joint_range ? `${Math.round(row.joint_range * 180 / Math.PI)}\u00b0` : "\u2013"), element("td", {}, solved ? button : "no way"));
      })))));
  }
  const actions = element("div", { className: "actions" });
  if (result.length > 0) actions.append(element("button", { type: "button", className: "use-length", textContent: "Use this length", onclick: () => use(result.length) }));
  if (watch) actions.append(element("button", { type: "button", textContent: "Watch", onclick: watch }));
  card.append(actions);
  return card;
}

/** All runs that have a motion, newest first. */
export class Runs {
  constructor({ store, watch, changed }) {
    Object.assign(this, { store, watch, changed, list: [], next: 1, marked: new Set() });
  }
  add({ title, planner, arm, scene, result }) {
    const run = { id: this.next++, title, planner, arm, scene, motion: result.motion, payload: result.payload, result };
    this.list.unshift(run);
    this.show();
    return run;
  }
  remove(run) {
    this.list = this.list.filter((one) => one !== run);
    this.marked.delete(run.id);
    this.show();
  }
  clear() {
    this.list = [];
    this.marked.clear();
    this.show();
  }
  isOld(run) {
    const now = this.store.scene, then = run.scene;
    return !(now === then || JSON.stringify([now.shapes, now.base, now.goal, now.goal_radius]) === JSON.stringify([then.shapes, then.base, then.goal, then.goal_radius]));
  }

  show() {
    byId("runs-section").hidden = !this.list.length;
    byId("runs").replaceChildren(...this.list.map((run) => this.item(run)));
    this.changed();
  }
  item(run) {
    const [word, tone] = verdictOf(run.result), old = this.isOld(run);
    const mark = element("input", { type: "checkbox", checked: this.marked.has(run.id), ariaLabel: `Show side by side: ${run.title}`, title: "Mark two to watch side by side" });
    mark.addEventListener("change", () => {
      if (mark.checked) this.marked.add(run.id); else this.marked.delete(run.id);
      if (this.marked.size === 2) {
        const both = this.list.filter(({ id }) => this.marked.has(id)).reverse();
        this.marked.clear();
        this.show();
        this.watch(both);
      }
    });
    return element("li", {}, mark,
      element("button", { type: "button", className: "name", title: "Watch", onclick: () => this.watch([run]) },
        element("span", { textContent: run.title }),
        element("small", {}, element("span", { className: `chip ${tone}`, textContent: word }), old ? " of an earlier drawing" : "")),
      element("button", { type: "button", className: "icon", ariaLabel: `Delete ${run.title}`, title: "Delete", innerHTML: '<svg><use href="#i-trash"/></svg>', onclick: () => this.remove(run) }));
  }
  /** After an edit, only the words change. */
  refresh() {
    clearTimeout(this.later);
    if (this.list.length) this.later = setTimeout(() => this.show(), 150);
  }
}
