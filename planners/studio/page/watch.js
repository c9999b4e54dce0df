// The Watch view: one run, or two side by side, in the player of the replay files.

const byId = (id) => document.getElementById(id);

export class Watch {
  constructor({ runs, fail }) {
    Object.assign(this, { runs, fail, player: null, shown: [] });
    byId("watch-first").addEventListener("change", () => this.chosen());
    byId("watch-second").addEventListener("change", () => this.chosen());
  }

  chosen() {
    const find = (id) => this.runs.list.find((run) => String(run.id) === byId(id).value);
    this.show([find("watch-first"), find("watch-second")].filter(Boolean));
  }

  async show(runs) {
    this.shown = runs;
    this.offer();
    const old = runs.filter((run) => this.runs.isOld(run)).length;
    byId("stale").hidden = !old;
    byId("stale").textContent = old === runs.length ? "The drawing has changed since." : "The drawing has changed since one of them.";
    this.close();
    byId("player").setAttribute("aria-label", runs.map((run) => run.title).join(", beside "));
    const payload = { ...runs[0].payload, traces: runs.map((run) => ({ ...run.payload.traces[0], title: run.title })) };
    try {
      const steps = new Set(runs.map((run) => run.payload.timestep));
      if (steps.size > 1) throw new Error("These two runs have different time steps, and cannot share a clock.");
      this.player = await window.HrsnakePlayer.mount(byId("player"), payload, { autoplay: true, keys: "document", controls: true, timing: true });
    } catch (error) {
      this.fail(error.message);
    }
  }

  offer() {
    const [first, second] = this.shown;
    const option = (run, chosen) => new Option(run.title, run.id, false, run === chosen);
    byId("watch-first").replaceChildren(...this.runs.list.map((run) => option(run, first)));
    byId("watch-second").replaceChildren(new Option("nothing", "", false, !second), ...this.runs.list.filter((run) => run !== first).map((run) => option(run, second)));
  }

  close() {
    this.player?.destroy();
    this.player = null;
  }
}
