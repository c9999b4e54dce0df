// Plays runs that hrsnake_env/replay.py has packed (`replay_payload`), with player.css. It loads nothing.
//
//   HrsnakePlayer.mount(host, payload, options) -> Promise<player>
//
// builds a player within an element; several may stand on one page. A later one in the same element ends the
// one before. The promise is kept when the first pose is drawn, and broken if the payload is.
//
// options   autoplay: true        plays at once, unless who looks on prefers reduced motion
//           keys: "host"          listens to keys while the focus is within the host; or "document", "none"
//           controls: true        shows slider and buttons
//           fragment: false       reads `#pose=120&play=0&speed=0.5&loop=0` behind the page's address
//           probe: false          writes what is shown to data-joints of the host, for tests
//           timing: false         keeps how long frames take, for `frameTimes`
// player    pose, last, playing, speed, loop, goTo(pose), step(by), play(), pause(), setSpeed(x), setLoop(on),
//           fit()                 shows the whole maze again
//           restyle()             reads the page's colours again, where the page itself changes them
//           frameTimes()          { intervals, draws }: the last 600 of each, in ms, while it played
//           on(event, callback)   "pose" (pose), "playing" (whether), "draw" (after each); returns what ends it
//           destroy()             leaves the host as it was, and nothing running
// host      data-ready, data-pose, data-playing say what is shown. Its height, or --player-height, is the
//           player's; where neither is given and where it is narrow, it is as high as it needs.
"use strict";

window.HrsnakePlayer = (() => {

// ---------------------------------------------------------------------------------------------------------
// Numbers: whole ones, as hrsnake_env/replay.py packs them. Places are relative to the base, y up.

async function inflated(text) {
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/** Return a table of whole numbers, row by row: column by column they are packed as differences. */
function unpacked(bytes, rows, columns, order) {
  const table = new Float64Array(rows * columns);
  let at = 0;
  for (let column = 0; column < columns; column++) {
    let value = 0, slope = 0;
    for (let row = 0; row < rows; row++) {
      let number = 0, place = 1, byte;
      do {
        byte = bytes[at++];
        number += (byte & 127) * place;
        place *= 128;
      } while (byte & 128);
      const difference = number % 2 ? -(number + 1) / 2 : number / 2;
      slope = order === 2 ? slope + difference : difference;
      value += slope;
      table[row * columns + column] = value;
    }
  }
  return table;
}

const FREE = 0, PINCH = 1, COLLISION = 2;
const CONTACT_COLUMNS = 9;

async function readTrace(packed) {
  const { nPoses, nLinks, quantum } = packed;
  const width = 2 * (nLinks + 1);
  const joints = unpacked(await inflated(packed.joints), nPoses, width, 2).map((value) => value * quantum);
  const trace = { ...packed, joints, width, angles: new Float32Array(nPoses * nLinks), feed: new Float64Array(nPoses) };
  measureJoints(trace);
  if (packed.clearances !== null) {
    const table = unpacked(await inflated(packed.clearances), nPoses, nLinks, 1);
    trace.clearances = table.map((value) => value * quantum);
    trace.least = new Float64Array(nPoses);
    trace.leastLink = new Int32Array(nPoses);
    for (let pose = 0; pose < nPoses; pose++) {
      let best = 0;
      for (let link = 1; link < nLinks; link++)
        if (trace.clearances[pose * nLinks + link] < trace.clearances[pose * nLinks + best]) best = link;
      trace.least[pose] = trace.clearances[pose * nLinks + best];
      trace.leastLink[pose] = best;
    }
  }
  await readContacts(trace);
  return trace;
}

/** Joint angles, in degrees, and the feed follow from the places of the joints. */
function measureJoints(trace) {
  const { joints, width, nPoses, nLinks, linkLength } = trace;
  const heading = trace.maze.base[2], ux = Math.cos(heading), uy = Math.sin(heading);
  for (let pose = 0; pose < nPoses; pose++) {
    const at = pose * width;
    trace.feed[pose] = joints[at] * ux + joints[at + 1] * uy + nLinks * linkLength;
    let before = heading;
    for (let link = 0; link < nLinks; link++) {
      const k = at + 2 * link;
      const now = Math.atan2(joints[k + 3] - joints[k + 1], joints[k + 2] - joints[k]);
      let turn = (now - before) % (2 * Math.PI);
      if (turn < -Math.PI) turn += 2 * Math.PI;
      if (turn >= Math.PI) turn -= 2 * Math.PI;
      trace.angles[pose * nLinks + link] = turn * 180 / Math.PI;
      before = now;
    }
  }
}

async function readContacts(trace) {
  trace.touching = new Uint8Array(trace.nPoses * trace.nLinks);
  trace.poseTouching = new Uint8Array(trace.nPoses);
  trace.contactsOf = Array.from({ length: trace.nPoses }, () => []);
  if (trace.contacts === null) return;
  const table = unpacked(await inflated(trace.contacts), trace.nContacts, CONTACT_COLUMNS, 1);
  for (let at = 0; at < table.length; at += CONTACT_COLUMNS) {
    const [pose, link, other, wall, corner, collision, x, y, clearance] = table.subarray(at, at + CONTACT_COLUMNS);
    const kind = collision ? COLLISION : PINCH, q = trace.quantum;
    trace.contactsOf[pose].push({ link, other, wall, corner, kind, x: x * q, y: y * q, clearance: clearance * q });
    for (const touched of other >= 0 ? [link, other] : [link]) {
      const k = pose * trace.nLinks + touched;
      trace.touching[k] = Math.max(trace.touching[k], kind);
    }
    trace.poseTouching[pose] = Math.max(trace.poseTouching[pose], kind);
  }
}

// ---------------------------------------------------------------------------------------------------------
// Colours and words

function mixed(from, to, share) {
  const channel = (colour, k) => parseInt(colour.slice(1 + 2 * k, 3 + 2 * k), 16);
  const parts = [0, 1, 2].map((k) => Math.round(channel(from, k) + share * (channel(to, k) - channel(from, k))));
  return `rgb(${parts.join(",")})`;
}

const MINUS = "\u2212";

/** Write a number with at least so many significant digits, in plain decimals. */
function written(value, digits) {
  if (value === 0) return "0";
  const decimals = Math.max(0, digits - 1 - Math.floor(Math.log10(Math.abs(value))));
  return value.toFixed(Math.min(decimals, 8)).replace("-", MINUS);
}

/** Write a length so that a tenth of the pinch tolerance shows. */
function lengthText(trace, value) {
  const decimals = Math.max(0, Math.min(8, 1 - Math.floor(Math.log10(trace.tolerance))));
  return `${value.toFixed(decimals).replace("-", MINUS)} ${trace.maze.units}`;
}

function depthText(trace, contact) {
  return contact.clearance < 0 ? `${lengthText(trace, -contact.clearance)} deep`
    : `${lengthText(trace, contact.clearance)} from it`;
}

// ---------------------------------------------------------------------------------------------------------
// One trace on the page

function sharpContext(canvas) {
  const ratio = window.devicePixelRatio || 1, box = canvas.getBoundingClientRect();
  const width = Math.max(1, Math.round(box.width * ratio)), height = Math.max(1, Math.round(box.height * ratio));
  if (canvas.width !== width || canvas.height !== height) {
    canvas.width = width;
    canvas.height = height;
  }
  const context = canvas.getContext("2d");
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, box.width, box.height);
  return { context, width: box.width, height: box.height };
}

function mazeWindow(trace, feederShare) {
  const { maze } = trace, margin = 0.02 * maze.size, behind = feederShare * maze.size;
  const xs = [-behind * Math.cos(maze.base[2])], ys = [-behind * Math.sin(maze.base[2])];
  for (const ring of maze.rings)
    for (let k = 0; k < ring.length; k += 2) {
      xs.push(ring[k] - margin, ring[k] + margin);
      ys.push(ring[k + 1] - margin, ring[k + 1] + margin);
    }
  const least = (values) => values.reduce((a, b) => Math.min(a, b));
  const most = (values) => values.reduce((a, b) => Math.max(a, b));
  return { x0: least(xs), x1: most(xs), y0: least(ys), y1: most(ys) };
}

class TraceView {
  constructor(player, trace, view) {
    Object.assign(this, { player, trace });
    this.view = view; // shared by runs in one maze: what is zoomed into in one is so in the other
    this.window = mazeWindow(trace, player.payload.feederShare);
    this.section = element(SECTION);
    player.find(".hp-traces").append(this.section);
    this.find = (query) => this.section.querySelector(query);
    this.canvas = this.find(".hp-stage canvas");
    this.hover = null; // a place on the stage, in CSS pixels
    this.link = -1; // the link that is pointed at
    this.writeHead();
    this.walls = new Path2D();
    for (const ring of trace.maze.rings) {
      for (let k = 0; k < ring.length - 2; k += 2)
        if (k) this.walls.lineTo(ring[k], ring[k + 1]); else this.walls.moveTo(ring[k], ring[k + 1]);
      this.walls.closePath();
    }
    this.angles = new AnglePlot(this, this.find("canvas.hp-angles"));
    this.clearances = trace.clearances ? new ClearancePlot(this, this.find("canvas.hp-clearances")) : null;
    this.listen();
  }

  get style() { return this.player.style; }
  get pose() { return Math.min(this.player.pose, this.trace.nPoses - 1); }

  /** Free links: the nearer to a wall, the lighter. What touches has a colour of its own. */
  linkColour(pose, link) {
    const { trace, player: { style, payload } } = this, k = pose * trace.nLinks + link;
    if (trace.touching[k] === COLLISION) return style.collision;
    if (trace.touching[k] === PINCH) return style.pinch;
    if (!trace.clearances) return style.arm;
    const [far, tolerance] = payload.clearanceScale; // in link lengths
    const share = Math.max(trace.clearances[k] / trace.linkLength, tolerance);
    return mixed(style.arm, style.near, Math.min(Math.max(Math.log(far / share) / Math.log(far / tolerance), 0), 1));
  }

  writeHead() {
    const { trace } = this;
    for (const heading of this.section.querySelectorAll(".hp-title")) heading.textContent = trace.title;
    this.canvas.setAttribute("aria-label", `The arm in the maze: ${trace.title}`);
    const chip = this.find(".hp-chip");
    chip.hidden = trace.clean === null;
    chip.textContent = trace.clean ? "clean" : "not clean";
    chip.classList.add(trace.clean ? "hp-good" : "hp-bad");
    for (const line of trace.summary) {
      const item = document.createElement("li");
      item.textContent = line;
      this.find(".hp-summary").append(item);
    }
    const hide = (query, hidden) => this.section.querySelectorAll(query).forEach((part) => { part.hidden = hidden; });
    hide(".hp-if-clearance", !trace.clearances);
    hide(".hp-unless-clearance", Boolean(trace.clearances));
    hide(".hp-if-contacts", trace.contacts === null);
    const far = this.player.payload.clearanceScale[0] * trace.linkLength;
    this.find(".hp-ramp-text").textContent =
      `free: ${written(far, 2)} to ${written(trace.tolerance, 2)} ${trace.maze.units} clear`;
  }

  // Screen: CSS pixels of the stage. World: maze units from the base, y up.

  place() {
    const { x0, x1, y0, y1 } = this.window, box = this.canvas.getBoundingClientRect();
    this.fitted = Math.min(box.width / (x1 - x0), box.height / (y1 - y0));
    const { view } = this;
    if (view.zoom === 1) Object.assign(view, { x: (x0 + x1) / 2, y: (y0 + y1) / 2 });
    this.scale = this.fitted * view.zoom;
    this.middle = { x: box.width / 2, y: box.height / 2 };
  }
  screen(x, y) {
    return [this.middle.x + (x - this.view.x) * this.scale, this.middle.y - (y - this.view.y) * this.scale];
  }
  zoomBy(factor, at = this.middle) {
    const zoom = Math.min(Math.max(this.view.zoom * factor, 1), 4000);
    const scale = this.fitted * zoom, shift = 1 / this.scale - 1 / scale;
    this.view.x += (at.x - this.middle.x) * shift;
    this.view.y -= (at.y - this.middle.y) * shift;
    this.view.zoom = zoom;
    this.player.redraw();
  }
  panBy(dx, dy) {
    if (this.view.zoom === 1) return;
    const { x0, x1, y0, y1 } = this.window;
    this.view.x = Math.min(Math.max(this.view.x - dx / this.scale, x0), x1);
    this.view.y = Math.min(Math.max(this.view.y + dy / this.scale, y0), y1);
    this.player.redraw();
  }
  fit() {
    this.view.zoom = 1;
    this.player.redraw();
  }

  listen() {
    const { canvas } = this, pointers = new Map();
    const local = (event) => {
      const box = canvas.getBoundingClientRect();
      return { x: event.clientX - box.left, y: event.clientY - box.top };
    };
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      pointers.set(event.pointerId, local(event));
      canvas.classList.add("hp-dragging");
    });
    canvas.addEventListener("pointermove", (event) => {
      const now = local(event), before = pointers.get(event.pointerId);
      if (!before) {
        this.point(event.pointerType === "touch" ? this.hover : now);
        return;
      }
      const others = [...pointers].filter(([id]) => id !== event.pointerId).map(([, place]) => place);
      if (others.length) {
        const [other] = others, apart = (a) => Math.hypot(a.x - other.x, a.y - other.y);
        this.zoomBy(apart(now) / Math.max(apart(before), 1), { x: (now.x + other.x) / 2, y: (now.y + other.y) / 2 });
      }
      const share = others.length ? 0.5 : 1;
      this.panBy(share * (now.x - before.x), share * (now.y - before.y));
      pointers.set(event.pointerId, now);
      this.point(event.pointerType === "touch" ? null : now);
    });
    const release = (event) => {
      pointers.delete(event.pointerId);
      if (!pointers.size) canvas.classList.remove("hp-dragging");
    };
    canvas.addEventListener("pointerup", release);
    canvas.addEventListener("pointercancel", release);
    canvas.addEventListener("pointerleave", (event) => { if (event.pointerType !== "touch") this.point(null); });
    canvas.addEventListener("click", (event) => this.point(local(event)));
    canvas.addEventListener("dblclick", () => this.fit());
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      const pixels = event.deltaY * (event.deltaMode === 1 ? 16 : 1);
      this.zoomBy(Math.exp(-Math.max(-200, Math.min(pixels, 200)) / 300), local(event));
    }, { passive: false });
    this.find(".hp-in").addEventListener("click", () => this.zoomBy(1.6));
    this.find(".hp-out").addEventListener("click", () => this.zoomBy(1 / 1.6));
    this.find(".hp-fit").addEventListener("click", () => this.fit());
  }

  point(place) {
    this.hover = place;
    this.player.redraw();
  }

  /** Say what is at the place that is pointed at: a contact, or else a link. */
  showTip() {
    const { trace, pose, hover } = this, tip = this.find(".hp-tip");
    const found = hover && this.under(hover);
    if (hover) this.link = found ? found.link : -1;
    else if (!this.angles.pointed) this.link = -1;
    tip.hidden = !found;
    if (!found) return;
    const k = pose * trace.nLinks + found.link;
    const lines = [];
    if (found.contact) {
      const { contact } = found;
      const what = contact.other >= 0 ? `link ${contact.other}`
        : contact.corner ? "a corner" : `wall ${contact.wall}`;
      lines.push(`${contact.kind === COLLISION ? "Collision" : "Pinch"}: link ${contact.link}, ${what}`,
        depthText(trace, contact), `at ${this.placeText(contact.x, contact.y)}`);
    } else {
      lines.push(`Link ${found.link}`, `joint angle ${trace.angles[k].toFixed(1).replace("-", MINUS)}°`);
      if (trace.clearances) lines.push(`clearance ${lengthText(trace, trace.clearances[k])}`);
    }
    tip.textContent = lines.join("\n");
    const left = Math.min(hover.x + 14, 2 * this.middle.x - tip.offsetWidth - 6);
    const top = hover.y + 16 + tip.offsetHeight > 2 * this.middle.y ? hover.y - tip.offsetHeight - 10 : hover.y + 16;
    tip.style.transform = `translate(${Math.max(left, 6)}px, ${Math.max(top, 6)}px)`;
  }
  under({ x, y }) {
    const { trace, pose } = this;
    let best = null, nearest = 13;
    for (const contact of trace.contactsOf[pose]) {
      const [cx, cy] = this.screen(contact.x, contact.y), apart = Math.hypot(cx - x, cy - y);
      if (apart < nearest) [best, nearest] = [{ link: contact.link, contact }, apart];
    }
    if (best) return best;
    nearest = 9;
    for (let link = 0; link < trace.nLinks; link++) {
      const k = pose * trace.width + 2 * link;
      const [ax, ay] = this.screen(trace.joints[k], trace.joints[k + 1]);
      const [bx, by] = this.screen(trace.joints[k + 2], trace.joints[k + 3]);
      const [dx, dy] = [bx - ax, by - ay];
      const t = Math.min(Math.max(((x - ax) * dx + (y - ay) * dy) / (dx * dx + dy * dy || 1), 0), 1);
      const apart = Math.hypot(ax + t * dx - x, ay + t * dy - y);
      if (apart < nearest) [best, nearest] = [{ link, contact: null }, apart];
    }
    return best;
  }
  placeText(x, y) {
    const [bx, by] = this.trace.maze.base;
    const decimals = Math.max(0, Math.min(6, -Math.floor(Math.log10(this.trace.linkLength)) + 2));
    return `(${(x + bx).toFixed(decimals)}, ${(y + by).toFixed(decimals)})`.replaceAll("-", MINUS);
  }

  writeFacts() {
    const { trace, pose } = this, k = (pose + 1) * trace.width - 2;
    const write = (query, text) => { this.find(query).textContent = text; this.find(query).title = text; };
    const count = (kind) => {
      let number = 0;
      for (let link = 0; link < trace.nLinks; link++) number += trace.touching[pose * trace.nLinks + link] === kind;
      return String(number);
    };
    write(".hp-feed", `${written(trace.feed[pose] < trace.quantum ? 0 : trace.feed[pose], 5)} ${trace.maze.units}`);
    write(".hp-tip-place", this.placeText(trace.joints[k], trace.joints[k + 1]));
    write(".hp-own-pose", `${pose} / ${trace.nPoses - 1}`);
    write(".hp-pinching", count(PINCH));
    write(".hp-colliding", count(COLLISION));
    if (trace.clearances) write(".hp-least", lengthText(trace, trace.least[pose]));
  }

  draw() {
    this.place();
    this.canvas.classList.toggle("hp-zoomed", this.view.zoom > 1);
    const { context, width, height } = sharpContext(this.canvas);
    context.lineJoin = context.lineCap = "round";
    this.showTip();
    this.drawMaze(context, width, height);
    this.drawTrail(context);
    this.drawArm(context);
    this.drawContacts(context);
    this.writeFacts();
    this.angles.draw();
    if (this.clearances) this.clearances.draw();
  }

  drawMaze(context, width, height) {
    const { maze } = this.trace, [x, y] = this.screen(0, 0), { scale } = this;
    context.fillStyle = this.style.wall;
    context.fillRect(0, 0, width, height);
    this.drawFeeder(context, x, y);
    context.save();
    context.translate(x, y);
    context.scale(scale, -scale);
    context.fillStyle = this.style.free;
    context.fill(this.walls, "evenodd");
    context.lineWidth = 1.25 / scale;
    context.lineJoin = "miter";
    context.strokeStyle = this.style.edge;
    context.stroke(this.walls);
    context.restore();
    const [gx, gy] = this.screen(...maze.goal), radius = maze.goalRadius * scale;
    context.fillStyle = context.strokeStyle = this.style.goal;
    context.globalAlpha = 0.28;
    circle(context, gx, gy, radius);
    context.fill();
    context.globalAlpha = 1;
    context.lineWidth = 1.5;
    circle(context, gx, gy, radius);
    context.stroke();
    const arm = Math.min(4, 0.55 * radius);
    strokes(context, [[gx - arm, gy - arm, gx + arm, gy + arm], [gx - arm, gy + arm, gx + arm, gy - arm]]);
  }

  /** Behind the base stands the feeder; a triangle at the base says where it pushes. */
  drawFeeder(context, x, y) {
    const { maze, linkRadius } = this.trace, heading = maze.base[2];
    const half = Math.max(linkRadius * this.scale + 4, 6), long = Math.hypot(x, y) + 4 * (this.middle.x + this.middle.y);
    context.save();
    context.translate(x, y);
    context.rotate(-heading);
    context.fillStyle = this.style.base;
    context.globalAlpha = 0.28;
    context.fillRect(-long, -half, long, 2 * half);
    context.restore();
  }
  drawBase(context) {
    const [x, y] = this.screen(0, 0), half = Math.max(this.trace.linkRadius * this.scale + 4, 6);
    context.save();
    context.translate(x, y);
    context.rotate(-this.trace.maze.base[2]);
    context.fillStyle = this.style.base;
    for (const side of [-1, 1]) {
      context.beginPath();
      context.moveTo(0, side * half);
      context.lineTo(-11, side * half);
      context.lineTo(-11, side * (half + 7));
      context.closePath();
      context.fill();
    }
    context.restore();
  }

  drawTrail(context) {
    const { trace, pose } = this;
    const trail = (from, to) => {
      context.beginPath();
      for (let k = from; k <= to; k++) {
        const at = (k + 1) * trace.width - 2, place = this.screen(trace.joints[at], trace.joints[at + 1]);
        if (k === from) context.moveTo(...place); else context.lineTo(...place);
      }
      context.stroke();
    };
    context.strokeStyle = this.style.goal;
    context.lineWidth = 1.5;
    context.globalAlpha = 0.3;
    context.setLineDash([2, 4]);
    trail(pose, trace.nPoses - 1);
    context.setLineDash([]);
    context.globalAlpha = 0.75;
    trail(0, pose);
    context.globalAlpha = 1;
  }

  drawArm(context) {
    const { trace, pose } = this, places = [];
    for (let joint = 0; joint <= trace.nLinks; joint++) {
      const k = pose * trace.width + 2 * joint;
      places.push(this.screen(trace.joints[k], trace.joints[k + 1]));
    }
    const thick = Math.max(2 * trace.linkRadius * this.scale, 3.5);
    const link = (k, colour, extra) => {
      context.strokeStyle = colour;
      context.lineWidth = thick + extra;
      strokes(context, [[...places[k], ...places[k + 1]]]);
    };
    const order = [...places.keys()].slice(0, -1);
    const kind = (k) => trace.touching[pose * trace.nLinks + k];
    if (this.link >= 0) link(this.link, this.style.ink, 5);
    // What touches is drawn last, and wider: colour alone does not tell.
    for (const rank of [FREE, PINCH, COLLISION])
      for (const k of order) if (kind(k) === rank) link(k, this.linkColour(pose, k), [0, 0.5, 2][rank]);
    this.drawBase(context);
    const [ax, ay] = places[0], [bx, by] = places[1];
    const dot = Math.min(2.6, Math.hypot(bx - ax, by - ay) / 6);
    context.fillStyle = this.style.joint;
    for (const [x, y] of places) {
      circle(context, x, y, dot);
      context.fill();
    }
    const [tx, ty] = places[places.length - 1];
    context.fillStyle = this.style.card;
    context.strokeStyle = this.style.joint;
    context.lineWidth = 2;
    circle(context, tx, ty, 4);
    context.fill();
    context.stroke();
  }

  drawContacts(context) {
    for (const contact of this.trace.contactsOf[this.pose]) {
      const [x, y] = this.screen(contact.x, contact.y), r = contact.kind === COLLISION ? 6 : 5;
      const shape = contact.kind === COLLISION
        ? () => strokes(context, [[x - r, y - r, x + r, y + r], [x - r, y + r, x + r, y - r]])
        : () => { circle(context, x, y, r); context.stroke(); };
      context.strokeStyle = this.style.free;
      context.lineWidth = 5;
      shape();
      context.strokeStyle = contact.kind === COLLISION ? this.style.collision : this.style.pinch;
      context.lineWidth = 2.5;
      shape();
    }
  }
}

function circle(context, x, y, radius) {
  context.beginPath();
  context.arc(x, y, radius, 0, 2 * Math.PI);
}
function strokes(context, lines) {
  context.beginPath();
  for (const [ax, ay, bx, by] of lines) {
    context.moveTo(ax, ay);
    context.lineTo(bx, by);
  }
  context.stroke();
}

// ---------------------------------------------------------------------------------------------------------
// Plots over poses. What does not change from pose to pose is drawn once, and kept.

class Plot {
  constructor(owner, canvas) {
    Object.assign(this, { owner, canvas, player: owner.player, trace: owner.trace });
    Object.assign(this, { kept: document.createElement("canvas"), key: "" });
    this.pointed = false;
    const poseAt = (event) => {
      const box = canvas.getBoundingClientRect(), share = (event.clientX - box.left - this.left) / this.inner;
      return Math.round(Math.min(Math.max(share, 0), 1) * this.player.last);
    };
    let held = false;
    canvas.addEventListener("pointerdown", (event) => {
      held = true;
      canvas.setPointerCapture(event.pointerId);
      this.player.goTo(poseAt(event));
    });
    canvas.addEventListener("pointermove", (event) => {
      if (held) this.player.goTo(poseAt(event));
      this.point(event, poseAt(event));
    });
    canvas.addEventListener("pointerup", () => { held = false; });
    canvas.addEventListener("pointercancel", () => { held = false; });
    canvas.addEventListener("pointerleave", () => { this.pointed = false; this.player.redraw(); });
  }
  get style() { return this.player.style; }
  get left() { return 40; }
  get inner() { return Math.max(this.width - this.left - 6, 1); }
  x(pose) { return this.left + this.inner * pose / Math.max(this.player.last, 1); }
  y(value) {
    const share = (this.scaled(value) - this.low) / (this.high - this.low);
    return this.height - 5 - (this.height - 11) * share;
  }
  point() {}

  draw() {
    const { context, width, height } = sharpContext(this.canvas);
    Object.assign(this, { width, height });
    if (width < 2 || height < 2) return;
    const key = [width, height, this.canvas.width, this.player.restyled].join();
    if (key !== this.key) {
      this.kept.width = this.canvas.width;
      this.kept.height = this.canvas.height;
      const paper = this.kept.getContext("2d"), ratio = this.canvas.width / width;
      paper.setTransform(ratio, 0, 0, ratio, 0, 0);
      paper.lineJoin = "round";
      this.drawKept(paper);
      this.key = key;
    }
    context.drawImage(this.kept, 0, 0, width, height);
    this.drawLive(context);
    context.strokeStyle = this.style.ink;
    context.lineWidth = 1;
    const x = this.x(this.owner.pose);
    strokes(context, [[x, 2, x, height - 2]]);
  }

  drawGrid(context, ticks, text) {
    context.font = "11px system-ui, sans-serif";
    context.textAlign = "right";
    context.textBaseline = "middle";
    context.strokeStyle = this.style.line;
    context.lineWidth = 1;
    let above = Infinity;
    for (const tick of ticks) {
      const y = this.y(tick);
      if (above - y < 13 && above !== Infinity) continue;
      above = y;
      strokes(context, [[this.left, y, this.width - 6, y]]);
      context.fillStyle = this.style.soft;
      context.fillText(text(tick), this.left - 6, Math.min(Math.max(y, 6), this.height - 6));
    }
  }

  /** Draw values over poses; of those that share a pixel the least and the largest. */
  drawLine(context, value) {
    const n = this.trace.nPoses, step = Math.max(1, Math.floor(n / (2 * this.inner)));
    context.beginPath();
    for (let pose = 0; pose < n; pose += step) {
      let low = value(pose), high = low;
      for (let k = pose + 1; k < Math.min(pose + step, n); k++) {
        low = Math.min(low, value(k));
        high = Math.max(high, value(k));
      }
      const x = this.x(pose);
      if (pose === 0) context.moveTo(x, this.y(low)); else context.lineTo(x, this.y(low));
      if (high > low) context.lineTo(x, this.y(high));
    }
    context.stroke();
  }
}

class AnglePlot extends Plot {
  constructor(owner, canvas) {
    super(owner, canvas);
    let most = 10;
    for (const angle of this.trace.angles) most = Math.max(most, Math.abs(angle));
    this.step = [5, 10, 15, 30, 45, 60, 90].find((step) => most / step <= 2.2) || 90;
    [this.low, this.high] = [-1.05 * most, 1.05 * most];
    this.most = most;
  }
  scaled(value) { return value; }
  angle(pose, link) { return this.trace.angles[pose * this.trace.nLinks + link]; }

  drawKept(context) {
    const ticks = [];
    for (let tick = -Math.floor(this.most / this.step) * this.step; tick <= this.most; tick += this.step) ticks.push(tick);
    this.drawGrid(context, ticks, (tick) => String(tick).replace("-", MINUS));
    const { nLinks } = this.trace;
    context.lineWidth = nLinks > 20 ? 0.8 : 1.2;
    context.globalAlpha = nLinks > 20 ? 0.55 : 0.85;
    for (let link = 0; link < nLinks; link++) {
      context.strokeStyle = mixed(this.style.first, this.style.last, nLinks > 1 ? link / (nLinks - 1) : 1);
      this.drawLine(context, (pose) => this.angle(pose, link));
    }
  }
  drawLive(context) {
    const { link, pose } = this.owner, note = this.owner.find(".hp-angle-note");
    note.textContent = link < 0 ? "" : `link ${link}: ${this.angle(pose, link).toFixed(1).replace("-", MINUS)}°`;
    this.owner.find(".hp-ramp-note").hidden = link >= 0;
    if (link < 0) return;
    for (const [colour, wide] of [[this.style.card, 6], [this.style.ink, 2.2]]) {
      context.strokeStyle = colour;
      context.lineWidth = wide;
      this.drawLine(context, (k) => this.angle(k, link));
    }
  }
  /** The line nearest to the pointer is the link that is pointed at, here and in the maze. */
  point(event, pose) {
    const y = event.clientY - this.canvas.getBoundingClientRect().top, k = Math.min(pose, this.trace.nPoses - 1);
    let best = -1, nearest = Infinity;
    for (let link = 0; link < this.trace.nLinks; link++) {
      const apart = Math.abs(this.y(this.angle(k, link)) - y);
      if (apart < nearest) [best, nearest] = [link, apart];
    }
    this.pointed = true;
    this.owner.link = best;
    this.player.redraw();
  }
}

class ClearancePlot extends Plot {
  constructor(owner, canvas) {
    super(owner, canvas);
    const least = this.trace.least.reduce((a, b) => Math.min(a, b), 0);
    this.low = this.scaled(Math.min(1.3 * least, -3 * this.trace.tolerance));
    this.high = this.scaled(1.4 * this.trace.linkLength);
  }
  /** Even steps within the pinch tolerance, equal factors beyond it. */
  scaled(value) { return Math.asinh(value / this.trace.tolerance); }

  drawKept(context) {
    const { tolerance, linkLength } = this.trace, { width } = this;
    const band = (from, to, colour) => {
      context.fillStyle = colour;
      context.globalAlpha = 0.16;
      context.fillRect(this.left, this.y(to), width - this.left - 6, this.y(from) - this.y(to));
      context.globalAlpha = 1;
    };
    band(-tolerance, tolerance, this.style.pinch);
    band(Math.sinh(this.low) * tolerance, -tolerance, this.style.collision);
    const ticks = [-1, -0.1, -0.01, 0, 0.01, 0.1, 1].map((share) => share * linkLength);
    const shown = ticks.filter((tick) => this.scaled(tick) >= this.low && this.scaled(tick) <= this.high);
    this.drawGrid(context, shown, (tick) => written(tick, 2));
    context.strokeStyle = this.style.arm;
    context.lineWidth = 1.5;
    this.drawLine(context, (pose) => this.trace.least[pose]);
  }
  drawLive() {
    const { trace, owner } = this;
    owner.find(".hp-clearance-note").textContent =
      `link ${trace.leastLink[owner.pose]}: ${lengthText(trace, trace.least[owner.pose])}`;
  }
}

// ---------------------------------------------------------------------------------------------------------
// What a player is made of

function element(text) {
  const template = document.createElement("template");
  template.innerHTML = text.trim();
  return template.content.firstElementChild;
}

const icon = (path) => `<svg viewBox="0 0 20 20"><path d="${path}"/></svg>`;
const button = (name, label, hint, path) =>
  `<button type="button" class="hp-${name}" aria-label="${label}" title="${hint}">${icon(path)}</button>`;
const PLAY_SIGN = "M5 3l12 7-12 7z", PAUSE_SIGN = "M5 3h4v14H5zM11 3h4v14h-4z";

const PAGE = `
<div class="hp-page">
  <div class="hp-traces"></div>
  <div class="hp-controls">
    <div class="hp-line">
      <div class="hp-ribbons"></div>
      <input class="hp-slider" type="range" min="0" max="0" step="1" value="0" aria-label="Pose">
    </div>
    <div class="hp-buttons">
      ${button("first", "First pose", "First pose (Home)", "M4 4h2v12H4zM16 4v12L7 10z")}
      ${button("back", "One pose back", "One pose back (left arrow)", "M13 4v12L5 10zM14 4h2v12h-2z")}
      ${button("play", "Play", "Play or pause (space)", PLAY_SIGN)}
      ${button("forward", "One pose forward", "One pose forward (right arrow)", "M7 4v12l8-6zM4 4h2v12H4z")}
      ${button("last", "Last pose", "Last pose (End)", "M14 4h2v12h-2zM4 4v12l9-6z")}
      ${button("loop", "Loop", "Loop (L)", "M5 8a5 5 0 0 1 5-4h3V1.500l4.500 3.500L13 8.500V6h-3a3 3 0 0 0-3 2zM15 12a5 5 0 0 1-5 4H7v2.500L2.500 15 7 11.500V14h3a3 3 0 0 0 3-2z")}
      <select class="hp-speed" aria-label="Speed" title="Speed">
        ${[0.25, 0.5, 1, 2, 4, 8].map((speed) => `<option value="${speed}">${speed}x</option>`).join("")}
      </select>
      <div class="hp-clock hp-number"><span class="hp-pose"></span> <small class="hp-time"></small></div>
      <div class="hp-space"></div>
      <div class="hp-keys"><kbd>space</kbd> play &nbsp;<kbd>&larr;</kbd> <kbd>&rarr;</kbd> step, with <kbd>shift</kbd>
        ten &nbsp;<kbd>home</kbd> <kbd>end</kbd> &nbsp;<kbd>L</kbd> loop &nbsp;<kbd>+</kbd> <kbd>-</kbd>
        <kbd>F</kbd> zoom, fit</div>
    </div>
  </div>
</div>`;

const SECTION = `
<section class="hp-trace">
  <div class="hp-head"><h2 class="hp-title"></h2><div class="hp-chip" hidden></div></div>
  <div class="hp-body">
    <div class="hp-stage">
      <canvas role="img"></canvas>
      <div class="hp-zoom">
        ${button("in", "Zoom in", "Zoom in (+, wheel, pinch)", "M9 4h2v5h5v2h-5v5H9v-5H4V9h5z")}
        ${button("out", "Zoom out", "Zoom out (-)", "M4 9h12v2H4z")}
        ${button("fit", "Fit", "Fit (F, double click)", "M3 3h5v2H5v3H3zM12 3h5v5h-2V5h-3zM3 12h2v3h3v2H3zM15 12h2v5h-5v-2h3z")}
      </div>
      <div class="hp-tip hp-number" hidden></div>
    </div>
    <div class="hp-side">
      <h2 class="hp-again hp-title"></h2>
      <dl class="hp-facts hp-number">
        <div><dt>Feed</dt><dd class="hp-feed"></dd></div>
        <div><dt>Tip</dt><dd class="hp-tip-place"></dd></div>
        <div class="hp-if-clearance"><dt>Clearance</dt><dd class="hp-least"></dd></div>
        <div class="hp-if-contacts"><dt>Links pinching</dt><dd class="hp-pinching"></dd></div>
        <div class="hp-if-contacts"><dt>Links colliding</dt><dd class="hp-colliding"></dd></div>
        <div class="hp-of-two"><dt>Pose</dt><dd class="hp-own-pose"></dd></div>
      </dl>
      <p class="hp-legend">
        <span class="hp-if-clearance"><i class="hp-ramp"></i><span class="hp-ramp-text"></span></span>
        <span class="hp-unless-clearance"><i class="hp-arm"></i>free</span>
        <span class="hp-if-contacts"><i class="hp-pinch"></i><svg class="hp-ring" viewBox="0 0 14 14"><circle cx="7" cy="7" r="4.600"/></svg>pinch</span>
        <span class="hp-if-contacts"><i class="hp-collision"></i><svg class="hp-cross" viewBox="0 0 14 14"><path d="M2.500 2.500l9 9m0-9l-9 9"/></svg>collision</span>
      </p>
      <div class="hp-plots">
        <div class="hp-plot"><h3>Joint angles, deg <span class="hp-number hp-angle-note"></span><span class="hp-ramp-note">base<i></i>tip</span></h3>
          <div><canvas class="hp-angles" role="img" aria-label="Joint angles over poses; a click goes to a pose"></canvas></div></div>
        <div class="hp-plot hp-if-clearance"><h3>Least clearance <span class="hp-number hp-clearance-note"></span></h3>
          <div><canvas class="hp-clearances" role="img" aria-label="Least clearance over poses; a click goes to a pose"></canvas></div></div>
      </div>
      <ul class="hp-summary"></ul>
    </div>
  </div>
</section>`;

// ---------------------------------------------------------------------------------------------------------
// The player: one clock for all traces. A shorter one waits at its end.

const COLOURS = ["card", "ink", "soft", "line", "accent", "wall", "edge", "free", "goal", "base", "arm", "near",
  "joint", "pinch", "collision", "first", "last"];
const DATA = ["ready", "pose", "playing", "joints"];
const READABLE = 40; // In s: longer runs open at a speed at which they take about this long.
const KEPT_TIMES = 600;
const DEFAULTS = { autoplay: true, keys: "host", controls: true, fragment: false, probe: false, timing: false };
const KEYS = {
  " ": (player) => player.setPlaying(!player.playing),
  ArrowLeft: (player, event) => player.step(event.shiftKey ? -10 : -1),
  ArrowRight: (player, event) => player.step(event.shiftKey ? 10 : 1),
  Home: (player) => player.step(-Infinity),
  End: (player) => player.step(Infinity),
  l: (player) => player.setLoop(!player.loop),
  f: (player) => player.fit(),
  "+": (player) => player.zoomBy(1.6), "=": (player) => player.zoomBy(1.6), "-": (player) => player.zoomBy(1 / 1.6),
};

class Player {
  constructor(host, payload, traces, options) {
    Object.assign(this, { host, payload, options, views: [], gone: new AbortController() });
    Object.assign(this, { clock: 0, playing: false, loop: true, speed: 1, before: null, rested: 0 });
    Object.assign(this, { frame: null, shown: null, restyled: 0, heard: new Map(), probing: options.probe });
    this.times = { intervals: [], draws: [] };
    this.last = Math.max(...traces.map((trace) => trace.nPoses)) - 1;
    this.page = element(PAGE);
    host.classList.add("hrsnake-player");
    host.replaceChildren(this.page);
    this.darkMode = matchMedia("(prefers-color-scheme: dark)");
    this.readStyle();
    this.build(traces);
    this.listen();
    this.open();
  }

  find(query) { return this.page.querySelector(query); }
  get pose() { return Math.min(Math.floor(this.clock), this.last); }

  build(traces) {
    const all = this.find(".hp-traces");
    this.find(".hp-slider").max = this.last;
    this.find(".hp-controls").hidden = !this.options.controls;
    all.classList.add(traces.length === 2 ? "hp-two" : "hp-one");
    const shared = new Map(); // runs in one maze share their view
    for (const trace of traces) {
      const maze = JSON.stringify(trace.maze);
      if (!shared.has(maze)) shared.set(maze, { zoom: 1, x: 0, y: 0 });
      this.views.push(new TraceView(this, trace, shared.get(maze)));
      this.find(".hp-ribbons").append(element('<canvas class="hp-ribbon"></canvas>'));
    }
    all.style.setProperty("--lines", Math.max(...traces.map((trace) => trace.summary.length)));
    all.classList.toggle("hp-tall", this.views.every(({ window: { x0, x1, y0, y1 } }) => x1 - x0 < 0.75 * (y1 - y0)));
  }

  listen() {
    const { signal } = this.gone, { options, host } = this;
    const on = (target, type, action) => target.addEventListener(type, action, { signal });
    const click = (name, action) => on(this.find(".hp-" + name), "click", action);
    click("play", () => this.setPlaying(!this.playing));
    click("first", () => this.step(-Infinity));
    click("last", () => this.step(Infinity));
    click("back", () => this.step(-1));
    click("forward", () => this.step(1));
    click("loop", () => this.setLoop(!this.loop));
    on(this.find(".hp-speed"), "change", (event) => this.setSpeed(Number(event.target.value)));
    on(this.find(".hp-slider"), "input", (event) => this.goTo(Number(event.target.value)));
    if (options.keys === "host" && !host.hasAttribute("tabindex")) {
      host.tabIndex = -1; // a click within it gives it the keys
      signal.addEventListener("abort", () => host.removeAttribute("tabindex"));
    }
    if (options.keys !== "none")
      on(options.keys === "host" ? host : document, "keydown", (event) => this.press(event));
    if (options.fragment) on(window, "hashchange", () => this.readFragment());
    on(this.darkMode, "change", () => this.restyle());
    const observer = new ResizeObserver(() => { this.drawRibbons(); this.redraw(); });
    observer.observe(host);
    for (const { canvas } of this.views) observer.observe(canvas);
    signal.addEventListener("abort", () => observer.disconnect());
  }

  press(event) {
    const action = KEYS[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    const { target } = event, writes = "select, textarea, input:not([type=range]), [contenteditable]";
    const own = target instanceof Element && (target.closest(writes) || (event.key === " " && target.closest("button")));
    if (!action || own || event.ctrlKey || event.metaKey || event.altKey || event.defaultPrevented) return;
    event.preventDefault();
    action(this, event);
  }

  open() {
    this.setLoop(true);
    const speeds = this.speeds().filter((speed) => speed >= 1), seconds = this.last * this.payload.timestep;
    this.setSpeed(speeds.find((speed) => seconds / speed <= READABLE) || speeds[speeds.length - 1]);
    this.setPlaying(this.options.autoplay && !matchMedia("(prefers-reduced-motion: reduce)").matches);
    if (this.options.fragment) this.readFragment();
    this.drawRibbons();
    this.drawAll(); // at once: a page in the background gets no frames
    this.host.dataset.ready = "1";
  }

  /** `#pose=120&play=0&speed=0.5&loop=0` behind the file's name says how it opens. */
  readFragment() {
    const wishes = new URLSearchParams(location.hash.slice(1));
    const number = (name) => (wishes.has(name) && Number.isFinite(Number(wishes.get(name))) ? Number(wishes.get(name)) : null);
    this.probing = wishes.has("probe") || this.options.probe;
    if (this.speeds().includes(number("speed"))) this.setSpeed(number("speed"));
    if (number("loop") !== null) this.setLoop(number("loop") !== 0);
    if (number("pose") !== null) this.goTo(Math.round(number("pose")));
    if (number("play") !== null) this.setPlaying(number("play") !== 0);
    this.redraw();
  }

  // The clock

  goTo(pose) {
    this.clock = Math.min(Math.max(Number(pose) || 0, 0), this.last);
    this.rested = 0;
    this.redraw();
  }
  step(by) {
    this.setPlaying(false);
    this.goTo(this.pose + by);
  }
  play() { this.setPlaying(true); }
  pause() { this.setPlaying(false); }
  setPlaying(playing) {
    if (this.gone.signal.aborted) return;
    if (playing && this.pose >= this.last) this.clock = 0;
    this.playing = Boolean(playing) && this.last > 0;
    this.before = null;
    this.rested = 0;
    const button = this.find(".hp-play");
    button.setAttribute("aria-label", this.playing ? "Pause" : "Play");
    button.querySelector("path").setAttribute("d", this.playing ? PAUSE_SIGN : PLAY_SIGN);
    this.host.dataset.playing = this.playing ? "1" : "0";
    this.tell("playing", this.playing);
    this.redraw();
  }
  setLoop(loop) {
    this.loop = Boolean(loop);
    this.find(".hp-loop").setAttribute("aria-pressed", String(this.loop));
  }
  speeds() { return Array.from(this.find(".hp-speed").options, (option) => Number(option.value)); }
  setSpeed(speed) {
    if (!(speed > 0 && speed < Infinity)) return;
    this.speed = speed;
    this.find(".hp-speed").value = String(speed);
  }
  advance(now) {
    const seconds = this.before === null ? 0 : Math.min((now - this.before) / 1000, 0.25);
    this.before = now;
    if (this.clock < this.last) {
      this.clock = Math.min(this.clock + this.speed * seconds / this.payload.timestep, this.last);
      return;
    }
    this.rested += seconds;
    if (!this.loop) this.setPlaying(false);
    else if (this.rested > 1) this.goTo(0);
  }

  // Drawing

  redraw() {
    if (this.frame !== null || !this.views.length || this.gone.signal.aborted) return;
    this.frame = requestAnimationFrame((now) => {
      this.frame = null;
      const { before } = this;
      if (this.playing) this.advance(now);
      const began = performance.now();
      this.drawAll();
      if (this.options.timing && this.playing && before !== null) {
        this.keepTime("intervals", now - before);
        this.keepTime("draws", performance.now() - began);
      }
      if (this.playing) this.redraw();
    });
  }
  keepTime(name, milliseconds) {
    this.times[name].push(milliseconds);
    if (this.times[name].length > KEPT_TIMES) this.times[name].shift();
  }
  frameTimes() { return { intervals: [...this.times.intervals], draws: [...this.times.draws] }; }

  drawAll() {
    const { pose, last, payload: { timestep } } = this, seconds = (k) => (k * timestep).toFixed(timestep < 0.01 ? 3 : 2);
    const slider = this.find(".hp-slider");
    slider.value = pose;
    slider.setAttribute("aria-valuetext", `pose ${pose} of ${last}`);
    this.find(".hp-pose").textContent = `Pose ${pose} / ${last}`;
    this.find(".hp-time").textContent = `${seconds(pose)} / ${seconds(last)} s`;
    for (const view of this.views) view.draw();
    this.host.dataset.pose = pose;
    if (this.probing) this.host.dataset.joints = JSON.stringify(this.views.map(probe));
    if (pose !== this.shown) this.tell("pose", pose);
    this.shown = pose;
    this.tell("draw");
  }

  /** Above the slider, for each trace: the poses with a pinch, and those with a collision. */
  drawRibbons() {
    this.views.forEach(({ trace }, number) => {
      const { context, width, height } = sharpContext(this.find(".hp-ribbons").children[number]);
      context.fillStyle = this.style.line;
      context.fillRect(0, 0, width * (trace.nPoses - 1) / Math.max(this.last, 1), height);
      for (let x = 0; x < width; x++) { // of the poses that share a pixel, the worst
        const from = Math.floor(x / width * this.last), to = Math.max(Math.ceil((x + 1) / width * this.last), from + 1);
        const kind = trace.poseTouching.subarray(from, to).reduce((a, b) => Math.max(a, b), FREE);
        if (kind === FREE) continue;
        context.fillStyle = kind === PINCH ? this.style.pinch : this.style.collision;
        context.fillRect(x, 0, 1, height);
      }
    });
  }

  /** Read the colours as #rrggbb. On light ground they are those of the payload. */
  readStyle() {
    const { host } = this, values = getComputedStyle(host), scheme = values.colorScheme;
    const dark = scheme === "dark" || (scheme !== "light" && this.darkMode.matches);
    for (const [name, colour] of Object.entries(this.payload.colours))
      if (dark) host.style.removeProperty("--" + name); else host.style.setProperty("--" + name, colour);
    const context = document.createElement("canvas").getContext("2d");
    this.style = {};
    for (const name of COLOURS) {
      context.fillStyle = values.getPropertyValue("--" + name).trim();
      this.style[name] = context.fillStyle;
    }
    this.restyled++;
  }
  restyle() {
    if (this.gone.signal.aborted) return;
    this.readStyle();
    this.drawRibbons();
    this.redraw();
  }

  zoomBy(factor) { new Map(this.views.map((view) => [view.view, view])).forEach((view) => view.zoomBy(factor)); }
  fit() { this.views.forEach((view) => view.fit()); }

  // Whoever mounted it

  on(event, callback) {
    if (!this.heard.has(event)) this.heard.set(event, new Set());
    this.heard.get(event).add(callback);
    return () => this.heard.get(event).delete(callback);
  }
  tell(event, ...what) {
    for (const callback of this.heard.get(event) || []) callback(...what);
  }

  destroy() {
    if (this.gone.signal.aborted) return;
    this.gone.abort();
    this.playing = false;
    this.heard.clear();
    if (this.frame !== null) cancelAnimationFrame(this.frame);
    const { host } = this;
    this.page.remove();
    host.classList.remove("hrsnake-player");
    for (const name of Object.keys(this.payload.colours)) host.style.removeProperty("--" + name);
    for (const name of DATA) delete host.dataset[name];
    if (latest.get(host) === this) latest.delete(host);
  }
}

function probe({ trace, pose }) {
  const row = (table, width) => (table ? Array.from(table.subarray(pose * width, (pose + 1) * width)) : null);
  return {
    pose, feed: trace.feed[pose], joints: row(trace.joints, trace.width), angles: row(trace.angles, trace.nLinks),
    clearances: row(trace.clearances, trace.nLinks), touching: row(trace.touching, trace.nLinks),
    contacts: trace.contactsOf[pose],
  };
}

const latest = new WeakMap(); // of each host the player, or the promise of one that is being read

async function mount(host, payload, options = {}) {
  const mine = {};
  const before = latest.get(host);
  if (before instanceof Player) before.destroy();
  latest.set(host, mine);
  const traces = await Promise.all(payload.traces.map(readTrace));
  if (latest.get(host) !== mine) throw new DOMException("Another player took this one's place.", "AbortError");
  const player = new Player(host, payload, traces, { ...DEFAULTS, ...options });
  latest.set(host, player);
  return player;
}

return { mount };

})();
