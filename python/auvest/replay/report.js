// The page of a replay: a map and plots over one time, drawn on canvases; no network, no library.
"use strict";
(() => {
const byId = (id) => document.getElementById(id);
const data = JSON.parse(byId("data").textContent);
const KINDS = { f4: Float32Array, f8: Float64Array, u1: Uint8Array, i4: Int32Array };
const INK = "#1a1a1a", FAINT = "#e3e6ea", SOFT = "#5b6470";
const SIGMAS = 3, FONT = "12px system-ui, sans-serif";
// Of a canvas that may be printed: more points than the screen needs.
const FINE = Math.max(2, window.devicePixelRatio || 1);

// ---- data ----

function column({ kind, offset, bytes }) {
  const text = atob(bytes), raw = new Uint8Array(text.length);
  for (let k = 0; k < text.length; ++k) raw[k] = text.charCodeAt(k);
  const values = new KINDS[kind](raw.buffer);
  return offset ? Float64Array.from(values, (v) => v + offset) : values;
}

function table(columns) {
  return columns && Object.fromEntries(Object.entries(columns).map(([name, c]) => [name, column(c)]));
}

const tracks = data.tracks.map((track, place) => ({
  ...track, place, estimates: table(track.estimates), errors: table(track.errors),
  measurements: table(track.measurements), doubted: table(track.doubted),
}));
const lines = data.lines.map((line) => ({ ...line, points: table(line.points) }));
const leaders = data.leaders.map((leader) => ({ ...leader, points: table(leader.points) }));
const REJECTED = data.outcomes.indexOf("rejected"), DOWN = data.outcomes.indexOf("downweighted");

// The first of sorted times that is not before.
function firstFrom(times, time) {
  let low = 0, high = times.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (times[middle] < time) low = middle + 1; else high = middle;
  }
  return low;
}

function nearest(times, time) {
  if (!times.length) return -1;
  const k = firstFrom(times, time);
  if (k === 0) return 0;
  return k < times.length && times[k] - time < time - times[k - 1] ? k : k - 1;
}

function number(value, digits = 3) {
  if (!Number.isFinite(value)) return "–";
  if (value === 0) return "0";
  const size = Math.abs(value);
  return size >= 1e5 || size < 1e-3 ? value.toExponential(2) : value.toFixed(Math.max(0, digits - Math.max(0, Math.floor(Math.log10(size)))));
}
const seconds = (time) => `${time.toFixed(1)} s`;

// ---- what all plots share ----

const state = { from: data.from_s, to: data.to_s, cursor: data.from_s, hover: null };
const span = Math.max(data.to_s - data.from_s, 1e-3);
const layers = new Map();
const shown = (name) => layers.get(name)?.checked ?? true;
const drawn = () => tracks.filter((track) => shown(track.key));
const charts = [];
let waiting = null, dirty = false;

// Drawn once after the event, however much it changes; a moved cursor alone leaves what lies below
// it as it is.
function redraw(all) {
  dirty ||= all;
  waiting ??= setTimeout(() => {
    if (dirty) drawAll(); else drawCursors();
    waiting = null;
    dirty = false;
  });
}

function drawAll() {
  map.draw();
  for (const chart of charts) chart.draw();
  drawCursors();
}

function drawCursors() {
  map.drawCursor();
  for (const chart of charts) chart.drawCursor();
  slider.value = state.cursor;
  slider.setAttribute("aria-valuetext", seconds(state.cursor));
  byId("now").textContent = seconds(state.cursor);
  byId("window").textContent = `${seconds(state.from)} to ${seconds(state.to)}`;
  tellNow();
}

function setWindow(from, to) {
  const width = Math.min(Math.max(to - from, span * 1e-5, 1e-3), span);
  from = Math.min(Math.max(from, data.from_s), data.to_s - width);
  state.from = from;
  state.to = width >= span ? data.to_s : from + width;
  redraw(true);
}

function zoomTime(factor, at = state.cursor) {
  const about = at >= state.from && at <= state.to ? at : 0.5 * (state.from + state.to);
  setWindow(about - (about - state.from) * factor, about + (state.to - about) * factor);
}

function panTime(share) {
  const step = share * (state.to - state.from);
  setWindow(state.from + step, state.to + step);
}

function setCursor(time) {
  state.cursor = Math.min(Math.max(time, data.from_s), data.to_s);
  const width = state.to - state.from;
  if (state.cursor < state.from || state.cursor > state.to) setWindow(state.cursor - width / 2, state.cursor + width / 2);
  redraw(false);
}

function setHover(time) {
  if (time === state.hover) return;
  state.hover = time;
  redraw(false);
}

const tip = byId("tip");
function showTip(event, text) {
  tip.hidden = text === null;
  if (text === null) return;
  tip.textContent = text;
  const { width, height } = tip.getBoundingClientRect();
  const right = event.clientX + 14 + width > innerWidth;
  tip.style.left = `${Math.max(4, right ? event.clientX - width - 14 : event.clientX + 14)}px`;
  tip.style.top = `${Math.max(4, event.clientY - height - 10)}px`;
}

// Two canvases, one over the other: what stays, and the cursor.
class Canvas {
  constructor(holder) {
    this.holder = holder;
    this.under = document.createElement("canvas");
    this.over = document.createElement("canvas");
    this.over.className = "over";
    this.under.setAttribute("aria-hidden", "true");
    this.over.tabIndex = 0;
    this.over.setAttribute("role", "img");
    holder.append(this.under, this.over);
  }
  get width() { return this.holder.clientWidth; }
  get height() { return this.holder.clientHeight; }
  begin(canvas) {
    const w = Math.round(this.width * FINE), h = Math.round(this.height * FINE);
    if (canvas.width !== w || canvas.height !== h) { canvas.width = w; canvas.height = h; }
    const pen = canvas.getContext("2d");
    pen.setTransform(FINE, 0, 0, FINE, 0, 0);
    pen.clearRect(0, 0, this.width, this.height);
    pen.font = FONT;
    pen.lineJoin = "round";
    return pen;
  }
  place(event) {
    const box = this.over.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  }
}

function ticks(low, high, count) {
  const rough = (high - low) / Math.max(count, 1);
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((m) => m * power).find((s) => s >= rough) ?? rough;
  const made = [];
  for (let k = Math.ceil(low / step); k * step <= high + 1e-9 * step && made.length < 50; ++k) made.push(k * step);
  return { values: made, digits: Math.max(0, -Math.floor(Math.log10(step) + 1e-9)) };
}

function mark(pen, kind, x, y, size = 4) {
  pen.beginPath();
  if (kind === "cross") {
    pen.moveTo(x - size, y - size); pen.lineTo(x + size, y + size);
    pen.moveTo(x - size, y + size); pen.lineTo(x + size, y - size);
    pen.stroke();
  } else if (kind === "ring") {
    pen.arc(x, y, size, 0, 2 * Math.PI); pen.stroke();
  } else if (kind === "up" || kind === "down") {
    const s = kind === "up" ? -size : size;
    pen.moveTo(x - size, y - s / 2); pen.lineTo(x + size, y - s / 2); pen.lineTo(x, y + s); pen.closePath(); pen.fill();
  } else if (kind === "square") {
    pen.strokeRect(x - size / 2, y - size / 2, size, size);
  } else if (kind === "diamond") {
    pen.moveTo(x - size, y); pen.lineTo(x, y - size); pen.lineTo(x + size, y); pen.lineTo(x, y + size); pen.closePath(); pen.stroke();
  } else if (kind === "plus") {
    pen.moveTo(x - size, y); pen.lineTo(x + size, y); pen.moveTo(x, y - size); pen.lineTo(x, y + size); pen.stroke();
  } else {
    pen.arc(x, y, size / 2, 0, 2 * Math.PI); pen.fill();
  }
}
// What was accepted has a shape for each filter, so that colours are not all that tells them apart.
const SHAPES = ["dot", "square", "diamond", "plus"];
// More marks than this are drawn simply, and not all lines of ranges: they would be one area.
const MANY = 1500;
const OUTCOME_MARKS = { [REJECTED]: "cross", [DOWN]: "ring" };

// ---- the plots over time ----

class Chart {
  constructor(spec) {
    Object.assign(this, spec);
    this.figure = document.createElement("figure");
    this.figure.id = this.id;
    const caption = document.createElement("figcaption"), title = document.createElement("span");
    title.textContent = this.title;
    this.said = document.createElement("output");
    this.said.setAttribute("aria-live", "off");  // the slider says what the reader has moved
    caption.append(title, this.said);
    const holder = document.createElement("div");
    holder.className = "plot";
    this.figure.append(caption, holder);
    byId("charts").append(this.figure);
    this.canvas = new Canvas(holder);
    this.canvas.over.setAttribute("aria-label",
      `${this.title} over time. Left and right move the time, plus and minus zoom, 0 shows all.`);
    listen(this.canvas, this);
  }
  x(time) { return this.left + (time - state.from) / (state.to - state.from) * (this.right - this.left); }
  y(value) { return this.bottom - (value - this.low) / (this.high - this.low) * (this.bottom - this.top); }
  time(x) { return state.from + (x - this.left) / (this.right - this.left) * (state.to - state.from); }

  get visible() { return this.series.filter((one) => shown(one.key)); }

  // From the numbers in the window: gross errors are drawn at the edge and do not flatten the rest.
  extent() {
    let low = this.least ?? Infinity, high = this.most ?? -Infinity, reach = Infinity;
    const bands = [];
    for (const one of this.visible) {
      const a = firstFrom(one.time, state.from), b = firstFrom(one.time, state.to + 1e-9);
      const stride = Math.max(1, Math.floor((b - a) / 3000));
      for (let k = a; one.band && k < b; k += stride) if (Number.isFinite(one.band[k])) bands.push(SIGMAS * one.band[k]);
      for (let k = a; k < b; ++k) {
        const v = one.values[k];
        if (v < low) low = v;
        if (v > high) high = v;
      }
    }
    if (bands.length) {
      bands.sort((p, q) => p - q);
      const wide = bands[Math.floor(0.9 * (bands.length - 1))];
      if (this.points) reach = 3 * wide;
      low = Math.min(low, -wide); high = Math.max(high, wide);
    }
    if (this.bound) { reach = 5 * this.bound; high = Math.max(high, 1.2 * this.bound); }
    if (!(high > low)) { const v = Number.isFinite(low) ? low : 0; low = v - 1; high = v + 1; }
    low = Math.max(low, -reach); high = Math.min(high, reach);
    const room = 0.06 * (high - low);
    this.low = this.least !== undefined ? this.least - (this.points ? room : 0) : low - room;
    this.high = high + room;
  }

  draw() {
    const pen = this.canvas.begin(this.canvas.under), { width, height } = this.canvas;
    this.left = 52; this.right = width - 10; this.top = 6 + 3 * Math.max(0, tracks.length - 1); this.bottom = height - 20;
    this.extent();
    this.drawUntrusted(pen);
    this.drawAxes(pen);
    pen.save();
    pen.beginPath();
    pen.rect(this.left, this.top - 4, this.right - this.left, this.bottom - this.top + 8);
    pen.clip();
    for (const one of this.visible) {
      const a = Math.max(0, firstFrom(one.time, state.from) - 1);
      const b = Math.min(one.time.length, firstFrom(one.time, state.to) + 1);
      if (one.band) this.drawBand(pen, one, a, b);
      if (this.points) this.drawPoints(pen, one, a, b); else this.drawLine(pen, one, a, b);
    }
    if (this.bound) {
      pen.strokeStyle = INK; pen.lineWidth = 1; pen.setLineDash([5, 4]);
      pen.beginPath(); pen.moveTo(this.left, this.y(this.bound)); pen.lineTo(this.right, this.y(this.bound)); pen.stroke();
    }
    pen.restore();
    Object.assign(this.figure.dataset, { from: state.from, to: state.to, low: this.low, high: this.high });
  }

  // Where a track is not to be trusted: grey, or with several a bar for each at the top.
  drawUntrusted(pen) {
    const judged = tracks.filter((track) => track.untrusted && shown(track.key));
    judged.forEach((track, row) => {
      pen.fillStyle = judged.length > 1 ? track.colour : "#e9e4dc";
      for (const [from, to] of track.untrusted) {
        if (to < state.from || from > state.to) continue;
        const a = Math.max(this.x(from), this.left), width = Math.max(Math.min(this.x(to), this.right) - a, 1.5);
        if (judged.length > 1) pen.fillRect(a, this.top - 6 + 4 * row, width, 3);
        else pen.fillRect(a, this.top, width, this.bottom - this.top);
      }
    });
  }

  drawAxes(pen) {
    pen.lineWidth = 1; pen.strokeStyle = FAINT; pen.fillStyle = SOFT;
    const down = ticks(this.low, this.high, (this.bottom - this.top) / 25);
    pen.textAlign = "right"; pen.textBaseline = "middle";
    for (const v of down.values) {
      const y = Math.round(this.y(v)) + 0.5;
      pen.beginPath(); pen.moveTo(this.left, y); pen.lineTo(this.right, y); pen.stroke();
      pen.fillText(v.toFixed(down.digits), this.left - 6, y);
    }
    const along = ticks(state.from, state.to, (this.right - this.left) / 90);
    pen.textAlign = "center"; pen.textBaseline = "top";
    for (const v of along.values) {
      const x = Math.round(this.x(v)) + 0.5;
      pen.beginPath(); pen.moveTo(x, this.top); pen.lineTo(x, this.bottom); pen.stroke();
      if (x < this.right - 26) pen.fillText(v.toFixed(along.digits), x, this.bottom + 5);
    }
    pen.textAlign = "right";
    pen.fillText("s", this.right, this.bottom + 5);
    if (this.low < 0 && this.high > 0) {
      pen.strokeStyle = "#9aa3ad";
      pen.beginPath(); pen.moveTo(this.left, this.y(0)); pen.lineTo(this.right, this.y(0)); pen.stroke();
    }
  }

  drawBand(pen, one, a, b) {
    pen.fillStyle = one.colour; pen.globalAlpha = this.series.length > 2 ? 0.09 : 0.15;
    const stride = Math.max(1, Math.floor((b - a) / (2 * (this.right - this.left))));
    const rows = [];
    for (let k = a; k < b; k += stride) if (Number.isFinite(one.band[k])) rows.push(k);
    pen.beginPath();
    for (const k of rows) pen.lineTo(this.x(one.time[k]), this.y(SIGMAS * one.band[k]));
    for (const k of rows.reverse()) pen.lineTo(this.x(one.time[k]), this.y(-SIGMAS * one.band[k]));
    pen.fill();
    pen.globalAlpha = 1;
  }

  // Per column of the picture the least and the greatest, so that no peak is lost.
  drawLine(pen, one, a, b) {
    pen.strokeStyle = one.colour; pen.lineWidth = one.width ?? 1.5; pen.setLineDash(one.dashes);
    pen.beginPath();
    let begun = false, column = null, least = 0, most = 0;
    const dense = b - a > 3 * (this.right - this.left);
    const flush = () => { if (column !== null) { pen.lineTo(column, least); pen.lineTo(column, most); } };
    for (let k = a; k < b; ++k) {
      if (!Number.isFinite(one.values[k])) { flush(); column = null; begun = false; continue; }
      const x = this.x(one.time[k]), y = this.y(one.values[k]);
      if (!begun) { pen.moveTo(x, y); begun = true; } else if (!dense) pen.lineTo(x, y);
      if (!dense) continue;
      if (column === null || x - column > 1) { flush(); column = x; least = most = y; }
      least = Math.min(least, y); most = Math.max(most, y);
    }
    flush();
    pen.stroke();
    pen.setLineDash([]);
  }

  drawPoints(pen, one, a, b) {
    pen.strokeStyle = pen.fillStyle = one.colour; pen.lineWidth = 1.3;
    const dense = b - a > MANY;
    for (let k = a; k < b; ++k) {
      const v = one.values[k];
      if (!Number.isFinite(v)) continue;
      const x = this.x(one.time[k]);
      if (dense && !OUTCOME_MARKS[one.outcome[k]] && v >= this.low && v <= this.high) {
        pen.fillRect(x - 1, this.y(v) - 1, 2, 2);
        continue;
      }
      if (v > this.high) mark(pen, "up", x, this.top + 2);
      else if (v < this.low) mark(pen, "down", x, this.bottom - 2);
      else mark(pen, OUTCOME_MARKS[one.outcome?.[k]] ?? SHAPES[one.place % SHAPES.length], x, this.y(v), OUTCOME_MARKS[one.outcome?.[k]] ? 3.5 : 3);
    }
  }

  drawCursor() {
    const pen = this.canvas.begin(this.canvas.over);
    for (const [time, strong] of [[state.hover, false], [state.cursor, true]]) {
      if (time === null || time < state.from || time > state.to) continue;
      pen.strokeStyle = strong ? INK : "#8a94a0"; pen.lineWidth = strong ? 1.4 : 1;
      pen.setLineDash(strong ? [] : [3, 3]);
      pen.beginPath(); pen.moveTo(this.x(time), this.top); pen.lineTo(this.x(time), this.bottom); pen.stroke();
    }
    pen.setLineDash([]);
    const values = this.at(state.cursor);
    for (const { one, k } of values) {
      const x = this.x(one.time[k]), y = Math.min(Math.max(this.y(one.values[k]), this.top), this.bottom);
      if (x < this.left - 1 || x > this.right + 1) continue;
      pen.fillStyle = "#fff"; pen.strokeStyle = one.colour; pen.lineWidth = 2;
      pen.beginPath(); pen.arc(x, y, 3.5, 0, 2 * Math.PI); pen.fill(); pen.stroke();
    }
    this.said.textContent = this.words(values);
    this.figure.dataset.cursor = state.cursor;
    this.figure.dataset.values = JSON.stringify(values.map(({ one, k }) => one.values[k]));
  }

  // The number of each curve that is nearest in time.
  at(time) {
    return this.visible.flatMap((one) => {
      const k = nearest(one.time, time);
      return k < 0 || !Number.isFinite(one.values[k]) ? [] : [{ one, k }];
    });
  }

  words(values) {
    const several = this.series.length > 1;
    return values.map(({ one, k }) => `${several ? `${one.label} ` : ""}${number(one.values[k])}${this.unit ? ` ${this.unit}` : ""}` +
      (one.outcome && OUTCOME_MARKS[one.outcome[k]] ? ` (${data.outcomes[one.outcome[k]]})` : "")).join(", ");
  }

  // What one does with a pointer or with keys.
  hover(event) {
    const [x] = this.canvas.place(event), time = this.time(x);
    if (time < state.from || time > state.to) { this.leave(); return; }
    setHover(time);
    const values = this.at(time);
    const when = values.length && this.points ? values[0].one.time[values[0].k] : time;
    showTip(event, `${seconds(when)}\n${this.title}\n${this.words(values)}`);
  }
  leave() { setHover(null); showTip(null, null); }
  press(event) { setCursor(this.time(this.canvas.place(event)[0])); }
  drag(dx) { panTime(-dx / (this.right - this.left)); }
  zoom(factor, event) { zoomTime(factor, event ? this.time(this.canvas.place(event)[0]) : state.cursor); }
  reset() { setWindow(data.from_s, data.to_s); }
  key(name, fine) {
    const step = (state.to - state.from) / (fine ? 500 : 50);
    if (name === "ArrowLeft") setCursor(state.cursor - step);
    else if (name === "ArrowRight") setCursor(state.cursor + step);
    else return false;
    return true;
  }
}

// Pointer, wheel and keys of a plot or the map. The wheel zooms where one has clicked before, or with
// Ctrl, so that the page can be scrolled over it.
function listen(canvas, owner) {
  const over = canvas.over, down = new Map();
  let moved = 0, apart = 0;
  over.addEventListener("pointerdown", (event) => {
    down.set(event.pointerId, event);
    moved = 0;
    apart = 0;
    if (event.isTrusted) over.setPointerCapture(event.pointerId);
  });
  over.addEventListener("pointermove", (event) => {
    const before = down.get(event.pointerId);
    if (!before) { owner.hover(event); return; }
    down.set(event.pointerId, event);
    if (down.size === 2) {
      const [p, q] = [...down.values()];
      const now = Math.hypot(p.clientX - q.clientX, p.clientY - q.clientY);
      if (apart) owner.zoom(apart / Math.max(now, 1), event);
      apart = now;
      return;
    }
    const dx = event.clientX - before.clientX, dy = event.clientY - before.clientY;
    moved += Math.abs(dx) + Math.abs(dy);
    if (moved > 4) owner.drag(dx, dy);
  });
  const up = (event) => {
    if (down.delete(event.pointerId) && moved <= 4 && event.type === "pointerup") owner.press(event);
  };
  over.addEventListener("pointerup", up);
  over.addEventListener("pointercancel", up);
  over.addEventListener("pointerleave", () => owner.leave());
  over.addEventListener("dblclick", () => owner.reset());
  over.addEventListener("wheel", (event) => {
    if (!event.ctrlKey && document.activeElement !== over) return;
    event.preventDefault();
    owner.zoom(event.deltaY > 0 ? 1.25 : 0.8, event);
  }, { passive: false });
  over.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    if (event.key === "+" || event.key === "=") owner.zoom(0.8);
    else if (event.key === "-") owner.zoom(1.25);
    else if (event.key === "0" || event.key === "Home") owner.reset();
    else if (!owner.key(event.key, event.shiftKey)) return;
    event.preventDefault();
  });
}

// ---- the map ----

// Half axes (m) and direction (rad) of the covariance ellipse of an estimate.
function ellipse(e, k) {
  const mean = 0.5 * (e.var_x_m2[k] + e.var_y_m2[k]), half = 0.5 * (e.var_x_m2[k] - e.var_y_m2[k]);
  const r = Math.hypot(half, e.cov_xy_m2[k]);
  return [Math.sqrt(mean + r), Math.sqrt(Math.max(mean - r, 0)), 0.5 * Math.atan2(2 * e.cov_xy_m2[k], 2 * half)];
}

class Plane {
  constructor(holder) {
    this.canvas = new Canvas(holder);
    this.figure = byId("map");
    this.canvas.over.setAttribute("aria-label",
      "Map of the tracks. Arrow keys move it, plus and minus zoom, 0 shows all.");
    listen(this.canvas, this);
    this.fitted = true;
  }
  fit() {
    let [left, right, low, high] = [Infinity, -Infinity, Infinity, -Infinity];
    const add = (xs, ys) => {
      for (let k = 0; k < xs.length; ++k) if (Number.isFinite(xs[k]) && Number.isFinite(ys[k])) {
        left = Math.min(left, xs[k]); right = Math.max(right, xs[k]);
        low = Math.min(low, ys[k]); high = Math.max(high, ys[k]);
      }
    };
    for (const { estimates } of tracks) add(estimates.x_m, estimates.y_m);
    for (const { points, key } of lines) if (key === "truth") add(points.x_m, points.y_m);
    for (const { points } of leaders) add(points.x_m, points.y_m);
    add(data.beacons.map((b) => b.x_m), data.beacons.map((b) => b.y_m));
    if (!(right >= left)) [left, right, low, high] = [-1, 1, -1, 1];
    // Below it there is room for the scale and the numbers of the grid.
    const above = 24, below = 60;
    this.scale = Math.min((this.canvas.width - 90) / Math.max(right - left, 1e-3),
      (this.canvas.height - above - below) / Math.max(high - low, 1e-3));
    this.x = 0.5 * (left + right);
    this.y = 0.5 * (low + high) - 0.5 * (below - above) / this.scale;
    this.fitted = true;
  }
  px(x) { return this.canvas.width / 2 + (x - this.x) * this.scale; }
  py(y) { return this.canvas.height / 2 - (y - this.y) * this.scale; }

  draw() {
    if (this.fitted) this.fit();
    const pen = this.canvas.begin(this.canvas.under), { width, height } = this.canvas;
    this.drawGrid(pen, width, height);
    for (const { points } of leaders) this.path(pen, points, data.looks.leader, 0.5, 0, points.time_s.length);
    for (const line of lines) if (shown(line.key)) this.windowed(pen, line.points, line);
    for (const track of drawn()) if (shown("doubted")) this.drawRanges(pen, track);
    for (const track of drawn()) {
      this.windowed(pen, track.estimates, track);
      if (shown("ellipses")) this.drawEllipses(pen, track);
    }
    pen.textAlign = "left"; pen.textBaseline = "middle";
    for (const beacon of data.beacons) {
      pen.fillStyle = data.looks.beacon.colour;
      mark(pen, "up", this.px(beacon.x_m), this.py(beacon.y_m), 6);
      pen.fillStyle = INK;
      pen.fillText(`${beacon.source}`, this.px(beacon.x_m) + 9, this.py(beacon.y_m));
    }
    this.drawScale(pen, height);
    Object.assign(this.figure.dataset, { x: this.x, y: this.y, scale: this.scale, from: state.from, to: state.to });
  }

  drawGrid(pen, width, height) {
    const box = { left: this.x - width / 2 / this.scale, right: this.x + width / 2 / this.scale,
      low: this.y - height / 2 / this.scale, high: this.y + height / 2 / this.scale };
    const along = ticks(box.left, box.right, width / 90), step = along.values[1] - along.values[0];
    pen.strokeStyle = FAINT; pen.fillStyle = SOFT; pen.lineWidth = 1;
    pen.textAlign = "center"; pen.textBaseline = "bottom";
    for (const v of along.values) {
      const x = Math.round(this.px(v)) + 0.5;
      pen.beginPath(); pen.moveTo(x, 0); pen.lineTo(x, height); pen.stroke();
      if (x > 40 && x < width - 20) pen.fillText(v.toFixed(along.digits), x, height - 4);
    }
    pen.textAlign = "left"; pen.textBaseline = "middle";
    for (let k = Math.ceil(box.low / step); k * step <= box.high; ++k) {
      const y = Math.round(this.py(k * step)) + 0.5;
      pen.beginPath(); pen.moveTo(0, y); pen.lineTo(width, y); pen.stroke();
      if (y > 10 && y < height - 24) pen.fillText((k * step).toFixed(along.digits), 5, y);
    }
    this.step = step;
  }

  drawScale(pen, height) {
    const length = this.step * this.scale;
    pen.fillStyle = "#ffffffd0"; pen.fillRect(40, height - 52, length + 12, 26);
    pen.strokeStyle = INK; pen.fillStyle = INK; pen.lineWidth = 2;
    pen.beginPath(); pen.moveTo(46, height - 34); pen.lineTo(46, height - 30); pen.lineTo(46 + length, height - 30); pen.lineTo(46 + length, height - 34); pen.stroke();
    pen.textAlign = "center"; pen.textBaseline = "bottom";
    pen.fillText(`${Number(this.step.toPrecision(3))} m`, 46 + length / 2, height - 33);
  }

  // A track: all of it faint, the part in the window of time strong.
  windowed(pen, points, look) {
    const a = Math.max(0, firstFrom(points.time_s, state.from) - 1);
    const b = Math.min(points.time_s.length, firstFrom(points.time_s, state.to) + 1);
    if (a > 0 || b < points.time_s.length) this.path(pen, points, look, 0.2, 0, points.time_s.length);
    this.path(pen, points, look, 1, a, b);
  }

  path(pen, points, look, alpha, from, to) {
    pen.globalAlpha = alpha; pen.strokeStyle = look.colour; pen.lineWidth = look.width ?? 1.7; pen.setLineDash(look.dashes ?? []);
    pen.beginPath();
    let [px, py, begun] = [0, 0, false];
    for (let k = from; k < to; ++k) {
      const x = this.px(points.x_m[k]), y = this.py(points.y_m[k]);
      if (!Number.isFinite(x + y)) { begun = false; continue; }
      if (!begun) { pen.moveTo(x, y); begun = true; }
      else if (Math.abs(x - px) + Math.abs(y - py) < 0.6) continue;
      else pen.lineTo(x, y);
      [px, py] = [x, y];
    }
    pen.stroke();
    pen.setLineDash([]);
    pen.globalAlpha = 1;
  }

  drawEllipses(pen, track) {
    const e = track.estimates, b = firstFrom(e.time_s, state.to + 1e-9);
    let [px, py] = [Infinity, Infinity];
    pen.strokeStyle = track.colour; pen.lineWidth = 1; pen.globalAlpha = 0.55;
    for (let k = firstFrom(e.time_s, state.from); k < b; ++k) {
      const x = this.px(e.x_m[k]), y = this.py(e.y_m[k]);
      if (!(Math.hypot(x - px, y - py) > 70 || px === Infinity)) continue;
      this.oval(pen, e, k);
      pen.stroke();
      [px, py] = [x, y];
    }
    pen.globalAlpha = 1;
  }

  oval(pen, e, k) {
    const [major, minor, angle] = ellipse(e, k);
    pen.beginPath();
    pen.ellipse(this.px(e.x_m[k]), this.py(e.y_m[k]), SIGMAS * major * this.scale, SIGMAS * minor * this.scale, -angle, 0, 2 * Math.PI);
  }

  // Where a range that was not believed says that the craft is, on the line from its source to the estimate.
  end(d, k) {
    const dx = d.x_m[k] - d.place_x_m[k], dy = d.y_m[k] - d.place_y_m[k], far = Math.hypot(dx, dy) || 1;
    return [this.px(d.place_x_m[k] + dx / far * d.range_m[k]), this.py(d.place_y_m[k] + dy / far * d.range_m[k])];
  }

  drawRanges(pen, track) {
    const d = track.doubted;
    if (!d) return;
    const a = firstFrom(d.time_s, state.from), b = firstFrom(d.time_s, state.to + 1e-9);
    pen.lineWidth = 1;
    const every = Math.ceil((b - a) / MANY);
    const line = Math.min(0.85, Math.max(0.05, 40 / (b - a))), end = Math.min(1, Math.max(0.25, 200 / (b - a)));
    for (let k = a; k < b; ++k) {
      const [x, y] = this.end(d, k);
      if (!Number.isFinite(x + y)) continue;
      pen.strokeStyle = track.colour;
      if ((k - a) % every === 0) {
        pen.setLineDash(d.outcome[k] === REJECTED ? [] : [2, 3]);
        pen.globalAlpha = line;
        pen.beginPath(); pen.moveTo(this.px(d.place_x_m[k]), this.py(d.place_y_m[k])); pen.lineTo(this.px(d.x_m[k]), this.py(d.y_m[k])); pen.lineTo(x, y); pen.stroke();
      }
      pen.setLineDash([]); pen.globalAlpha = end;
      mark(pen, OUTCOME_MARKS[d.outcome[k]] ?? "dot", x, y, 3.5);
    }
    pen.globalAlpha = 1;
  }

  drawCursor() {
    const pen = this.canvas.begin(this.canvas.over), at = [];
    for (const { points, source } of leaders) {
      const k = nearest(points.time_s, state.cursor);
      if (k < 0) continue;
      pen.fillStyle = data.looks.leader.colour; pen.textAlign = "left"; pen.textBaseline = "middle";
      mark(pen, "up", this.px(points.x_m[k]), this.py(points.y_m[k]), 6);
      pen.fillStyle = INK; pen.fillText(`${source}`, this.px(points.x_m[k]) + 9, this.py(points.y_m[k]));
    }
    for (const track of drawn()) {
      const e = track.estimates;
      for (const [time, strong] of [[state.hover, false], [state.cursor, true]]) {
        const k = time === null ? -1 : nearest(e.time_s, time);
        if (k < 0) continue;
        const x = this.px(e.x_m[k]), y = this.py(e.y_m[k]);
        if (strong) {
          at.push([e.x_m[k], e.y_m[k]]);
          this.oval(pen, e, k);
          pen.fillStyle = track.colour; pen.globalAlpha = 0.2; pen.fill(); pen.globalAlpha = 1;
          pen.strokeStyle = track.colour; pen.lineWidth = 1.5; pen.stroke();
        }
        pen.fillStyle = strong ? track.colour : "#fff"; pen.strokeStyle = strong ? "#fff" : track.colour; pen.lineWidth = 2;
        pen.beginPath(); pen.arc(x, y, 5, 0, 2 * Math.PI); pen.fill(); pen.stroke();
      }
    }
    Object.assign(this.figure.dataset, { cursor: state.cursor, at: JSON.stringify(at) });
  }

  hover(event) {
    const [x, y] = this.canvas.place(event);
    let best = null, least = 18;
    const consider = (px, py, reach, found) => {
      const far = Math.hypot(px - x, py - y) * reach;
      if (far < least) { least = far; best = found; }
    };
    for (const track of drawn()) {
      const e = track.estimates, b = firstFrom(e.time_s, state.to + 1e-9);
      for (let k = firstFrom(e.time_s, state.from); k < b; ++k) consider(this.px(e.x_m[k]), this.py(e.y_m[k]), 1, { track, k });
    }
    for (const track of drawn()) {
      const d = track.doubted;
      if (!d || !shown("doubted")) continue;
      const b = firstFrom(d.time_s, state.to + 1e-9);
      for (let k = firstFrom(d.time_s, state.from); k < b; ++k) consider(...this.end(d, k), 2, { track, doubted: k });
    }
    if (!best) { this.leave(); return; }
    const { track, k, doubted } = best;
    if (doubted !== undefined) {
      const d = track.doubted;
      setHover(d.time_s[doubted]);
      showTip(event, `${seconds(d.time_s[doubted])}  ${track.label}\n${data.outcomes[d.outcome[doubted]]}: ${number(d.range_m[doubted])} m to source ${d.source[doubted]}\n` +
        `innovation ${number(d.innovation_0[doubted])} m, NIS ${number(d.nis[doubted])}, weight ${number(d.weight[doubted])}`);
      return;
    }
    setHover(track.estimates.time_s[k]);
    showTip(event, pose(track, k));
  }
  leave() { setHover(null); showTip(null, null); }
  press() { if (state.hover !== null) setCursor(state.hover); }
  drag(dx, dy) { this.move(dx, dy); }
  move(dx, dy) { this.fitted = false; this.x -= dx / this.scale; this.y += dy / this.scale; redraw(true); }
  zoom(factor, event) {
    const [sx, sy] = event ? this.canvas.place(event) : [this.canvas.width / 2, this.canvas.height / 2];
    const x = this.x + (sx - this.canvas.width / 2) / this.scale, y = this.y - (sy - this.canvas.height / 2) / this.scale;
    this.fitted = false;
    this.scale /= factor;
    this.x = x - (sx - this.canvas.width / 2) / this.scale; this.y = y + (sy - this.canvas.height / 2) / this.scale;
    redraw(true);
  }
  reset() { this.fitted = true; redraw(true); }
  key(name) {
    const moves = { ArrowLeft: [40, 0], ArrowRight: [-40, 0], ArrowUp: [0, 40], ArrowDown: [0, -40] };
    if (!moves[name]) return false;
    this.move(...moves[name]);
    return true;
  }
}

function pose(track, k) {
  const e = track.estimates;
  return `${seconds(e.time_s[k])}  ${track.label}\nx ${number(e.x_m[k])} m, y ${number(e.y_m[k])} m\n` +
    `sigma ${number(Math.sqrt(e.var_x_m2[k]))} m along x, ${number(Math.sqrt(e.var_y_m2[k]))} m along y`;
}

// The table below the slider: each track at the time that it says.
function tellNow() {
  byId("poses").replaceChildren(...tracks.map((track) => {
    const row = document.createElement("tr"), e = track.estimates, k = nearest(e.time_s, state.cursor);
    const cells = k < 0 ? [track.label, "–", "–", "–", "–"] : [track.label, number(e.x_m[k]), number(e.y_m[k]),
      number(Math.sqrt(e.var_x_m2[k])), number(Math.sqrt(e.var_y_m2[k]))];
    cells.forEach((text, place) => {
      const cell = document.createElement(place ? "td" : "th");
      if (!place) cell.append(sample(track));
      cell.append(text);
      row.append(cell);
    });
    return row;
  }));
}

// ---- what there is to draw ----

function errorCharts() {
  const scored = tracks.filter((track) => track.errors);
  for (const axis of scored.length ? ["x", "y"] : []) {
    charts.push(new Chart({ id: `error-${axis}`, title: `Error of ${axis}, and three sigma / m`, unit: "m",
      series: scored.map((track) => ({ ...look(track), time: track.errors.time_s,
        values: track.errors[`error_${axis}_m`], band: track.errors[`sigma_${axis}_m`] })) }));
  }
}

function look({ key, place, label, colour, dashes }) { return { key, place, label, colour, dashes }; }

function sigmaChart() {
  charts.push(new Chart({ id: "sigma", title: "Sigma of the position, its longer axis / m", unit: "m", least: 0,
    series: tracks.map((track) => ({ ...look(track), time: track.estimates.time_s,
      values: Float64Array.from(track.estimates.time_s, (_, k) => ellipse(track.estimates, k)[0]) })) }));
}

function pick(table, rows, names) {
  return Object.fromEntries(names.map((name) => [name, Float64Array.from(rows, (k) => table[name][k])]));
}

const SOURCES_DRAWN = 8;
function innovationCharts() {
  for (const [number, sensor] of data.sensors.entries()) {
    const measured = tracks.filter((track) => track.measurements?.sensor.includes(number));
    if (!measured.length) continue;
    const counts = new Map();
    for (const { measurements: m } of measured) {
      for (let k = 0; k < m.source.length; ++k) if (m.sensor[k] === number) counts.set(m.source[k], (counts.get(m.source[k]) ?? 0) + 1);
    }
    const order = [...counts].sort((p, q) => q[1] - p[1]).map(([source]) => source);
    const own = order.slice(0, SOURCES_DRAWN).sort((p, q) => p - q);
    const groups = own.map((s) => [sensor.sources ? `, source ${s}` : "", `${sensor.name}-${s}`, (source) => source === s]);
    if (order.length > own.length) groups.push([", all other sources", `${sensor.name}-others`, (source) => !own.includes(source)]);
    for (const [name, key, mine] of groups) sensor.measured.forEach(({ what, unit }, m) => {
      const series = measured.flatMap((track) => {
        const all = track.measurements, rows = [];
        for (let k = 0; k < all.time_s.length; ++k) {
          // Near the station the innovation is an error of the position and has no place among these.
          if (all.sensor[k] === number && mine(all.source[k]) && !all.near_field[k] && Number.isFinite(all[`innovation_${m}`][k])) rows.push(k);
        }
        const part = pick(all, rows, ["time_s", `innovation_${m}`, `sigma_${m}`, "outcome"]);
        return rows.length ? [{ ...look(track), time: part.time_s, values: part[`innovation_${m}`], band: part[`sigma_${m}`], outcome: part.outcome }] : [];
      });
      if (series.length) charts.push(new Chart({ id: `innovation-${key}-${m}`, title: `Innovation of ${what}${name} / ${unit}`, unit, points: true, series }));
    });
  }
}

function measurementCharts() {
  const measured = tracks.filter((track) => track.measurements);
  const one = (id, title, unit, name, more = {}) => {
    const series = measured.flatMap((track) => {
      const all = track.measurements, rows = [];
      for (let k = 0; k < all.time_s.length; ++k) if (Number.isFinite(all[name][k])) rows.push(k);
      const part = pick(all, rows, ["time_s", name, "outcome"]);
      return rows.length ? [{ ...look(track), time: part.time_s, values: part[name], outcome: part.outcome }] : [];
    });
    if (series.length) charts.push(new Chart({ id, title, unit, points: true, series, ...more }));
  };
  // Of measurements with different numbers the NIS is drawn over its own limit.
  const title = data.nis_95 === null ? "NIS before any weight, over its own limit of 95 %" : `NIS before any weight, 95 % below ${data.nis_95.toFixed(2)}`;
  one("nis", title, "", "nis_drawn", { least: 0, bound: data.nis_95 ?? 1 });
  one("weight", "Weight", "", "weight", { least: 0, most: 1 });
  one("interval", "Time since the measurement before / s", "s", "interval_s", { least: 0 });
  one("held-out", "Error of predicting held-out measurements / m", "m", "held_out_error_m");
}

// A short piece of the line, for legends.
function sample({ colour, dashes, shape }) {
  const canvas = document.createElement("canvas"), pen = canvas.getContext("2d");
  canvas.setAttribute("aria-hidden", "true");
  canvas.className = "sample"; canvas.width = 72; canvas.height = 24;
  pen.setTransform(2, 0, 0, 2, 0, 0);
  pen.strokeStyle = pen.fillStyle = colour; pen.lineWidth = shape ? 1.4 : 2.2;
  if (shape) mark(pen, shape, 18, 6, shape === "dot" ? 5 : 4);
  else { pen.setLineDash(dashes ?? []); pen.beginPath(); pen.moveTo(1, 6); pen.lineTo(35, 6); pen.stroke(); }
  return canvas;
}

function legend() {
  const entry = (look, text, layer) => {
    const item = document.createElement("li"), label = document.createElement("label");
    if (layer) {
      const box = document.createElement("input");
      box.type = "checkbox"; box.checked = true;
      box.addEventListener("change", () => redraw(true));
      layers.set(layer, box);
      label.append(box);
    }
    if (look) label.append(sample(look));
    label.append(text);
    item.append(label);
    byId("legend").append(item);
  };
  for (const track of tracks) entry(track, track.label, tracks.length > 1 ? track.key : null);
  for (const line of lines) entry(line, line.label, line.key);
  if (data.beacons.length) entry({ ...data.looks.beacon, shape: "up" }, "beacon, with its number");
  if (leaders.length) entry({ ...data.looks.leader, shape: "up" }, "leader, with its number");
  entry(null, "ellipses, three sigma", "ellipses");
  if (tracks.some((track) => track.doubted?.time_s.length)) {
    entry({ colour: INK, shape: "cross" }, "rejected, drawn to its source", "doubted");
    entry({ colour: INK, shape: "ring" }, "down-weighted, likewise (dotted)");
  }
}

legend();
const map = new Plane(document.querySelector("#map .plot"));
errorCharts();
sigmaChart();
innovationCharts();
measurementCharts();

const slider = byId("time");
Object.assign(slider, { min: data.from_s, max: data.to_s, step: span / 1000, value: data.from_s });
slider.addEventListener("input", () => setCursor(Number(slider.value)));
const ACTIONS = {
  in: () => zoomTime(0.5), out: () => zoomTime(2), earlier: () => panTime(-0.5), later: () => panTime(0.5),
  all: () => setWindow(data.from_s, data.to_s), nearer: () => map.zoom(1 / 1.5), farther: () => map.zoom(1.5), fit: () => map.reset(),
};
for (const button of document.querySelectorAll("button[data-act]")) button.addEventListener("click", ACTIONS[button.dataset.act]);

drawAll();
new ResizeObserver(() => redraw(true)).observe(byId("charts"));
document.documentElement.dataset.drawnMs = performance.now().toFixed(0);
})();
