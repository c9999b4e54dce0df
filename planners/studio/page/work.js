// Jobs of the server, one at a time: what is going on, and how to end it.

import { job, stop } from "./api.js";

const byId = (id) => document.getElementById(id);

export class Work {
  constructor({ fail }) {
    Object.assign(this, { fail, control: null, id: null });
    byId("cancel").addEventListener("click", () => this.cancel());
    byId("stop").addEventListener("click", async () => {
      if (!this.id) return;
      byId("stop").disabled = true;
      byId("work-stage").textContent = "Stopping\u2026";
      try { await stop(this.id); } catch (error) { this.fail(error.message); }
    });
  }
  get busy() { return this.control !== null; }
  cancel() { this.control?.abort(); }

  /**
   * Run what needs the server: `act(ask)` may ask several times with `ask(path, body, title)`. Errors are said, but for
   * cancelling. Returns what `act` returns, or null.
   */
  async run(title, act, { stoppable = false } = {}) {
    if (this.busy) return null;
    this.control = new AbortController();
    const began = performance.now();
    const tick = setInterval(() => { byId("work-time").textContent = `${((performance.now() - began) / 1000).toFixed(1)} s`; }, 100);
    document.documentElement.dataset.busy = "1";
    document.body.classList.add("busy");
    Object.assign(byId("stop"), { hidden: !stoppable, disabled: false });
    byId("work").hidden = byId("work-time").hidden = false;
    byId("work-time").textContent = "";
    byId("work").scrollIntoView({ block: "nearest" });
    try {
      return await act((path, body, name) => this.ask(path, body, name ?? title));
    } catch (error) {
      if (error.kind !== "cancelled") this.fail(error.message);
      return null;
    } finally {
      clearInterval(tick);
      this.control = this.id = null;
      byId("work").hidden = true;
      document.body.classList.remove("busy");
      document.documentElement.dataset.busy = "0";
    }
  }

  async ask(path, body, title) {
    byId("work-title").textContent = title;
    byId("work-stage").textContent = "";
    byId("work-news").hidden = true;
    byId("work-bar").removeAttribute("value");
    return job(path, body, { signal: this.control.signal, heard: (line) => this.hear(line) });
  }
  hear(line) {
    if (line.type === "job") this.id = line.id;
    if (line.type === "queued") byId("work-stage").textContent = line.ahead > 0 ? `waiting, ${line.ahead} ahead` : line.warming ? "warming up" : "starting";
    if (line.type !== "progress") return;
    if (line.stage) byId("work-stage").textContent = line.stage;
    if (typeof line.share === "number") byId("work-bar").value = Math.min(Math.max(line.share, 0), 1);
    if (line.news) {
      byId("work-news").hidden = false;
      byId("work-news").textContent = line.news;
    }
  }
}
