// The page: what is chosen goes to the worker, what it reports is drawn.
import workerText from "made/worker.txt";
import { KINDS } from "./kinds.mjs";
import { LINES } from "./lines_shown.mjs";
import { Strip, clear } from "./strip.mjs";

const SPEEDS = [
  [1, "1\u00d7"],
  [4, "4\u00d7"],
  [10, "10\u00d7"],
  [0, "max"],
];
const FRAME = 50; // between two drawings at least [ms]: the chip needs the processor, too
const PLOTTED = 5; // of so many drawings one has the plots, too
const REST = 3; // between the end of a run and the next [s]

const $ = (id) => document.getElementById(id);
const chosen = new URLSearchParams(location.hash.slice(1));
const blob = URL.createObjectURL(new Blob([workerText], { type: "text/javascript" }));

let kind = chosen.get("show") === "mission" ? "mission" : "tracking";
let speed = chosen.has("speed") ? Number(chosen.get("speed")) : null; // null: what suits the kind
let seed = 1;
let paused = false;
let rows = [];
let worker = null;
let strips = [];
let last = null; // state that the worker has reported
let settings = {};
let policy = 0;
let pending = false; // a drawing is on its way
let drawings = 0;
let next = 0; // timer of the next run

// What a test looks at.
const seen = { state: null, runs: [], checked: null, errors: [], rows: () => rows };
window.auvest = seen;
window.addEventListener("error", ({ message }) => seen.errors.push(message));

function element(name, properties = {}, ...children) {
  const made = Object.assign(document.createElement(name), properties);
  made.append(...children);
  return made;
}

/** Buttons of which one is pressed. */
function choice(options, value, choose) {
  const buttons = options.map(([key, label]) => {
    const button = element("button", { textContent: label });
    button.setAttribute("aria-pressed", String(key === value));
    button.onclick = () => {
      for (const other of buttons) other.setAttribute("aria-pressed", String(other === button));
      choose(key);
    };
    return button;
  });
  return buttons;
}

function slider({ name, label, min, max, step, value, show }) {
  const output = element("output", { textContent: show(value) });
  const input = element("input", { type: "range", min, max, step, value });
  input.name = name;
  input.oninput = () => {
    settings[name] = Number(input.value);
    output.textContent = show(settings[name]);
    worker.postMessage({ kind: "set", settings: scaled() });
  };
  return element("label", { className: "field" }, element("span", {}, label, output), input);
}

/** The settings in the units of the simulation. */
function scaled() {
  const { sliders } = KINDS[kind];
  return Object.fromEntries(sliders.map(({ name, scale = 1 }) => [name, settings[name] * scale]));
}

function show() {
  const { sliders, policies, legend, plots, speed: usual } = KINDS[kind];
  for (const tab of document.querySelectorAll("nav button")) {
    tab.setAttribute("aria-selected", String(tab.dataset.kind === kind));
  }
  policy = 0;
  settings = Object.fromEntries(sliders.map(({ name, value }) => [name, value]));
  $("sliders").replaceChildren(...sliders.map(slider));
  const options = policies.map((label, i) => [i, label]);
  const buttons = choice(options, policy, (key) => {
    policy = key;
    start();
  });
  $("policy").replaceChildren(
    element("p", { textContent: "Next fix" }),
    element("div", { className: "choice" }, ...buttons),
  );
  $("legend").replaceChildren(
    ...legend.map(([colour, label, form]) => {
      const mark = element("i", { className: form ?? "" });
      mark.style.color = mark.style.borderColor = colour;
      return element("span", {}, mark, label);
    }),
  );
  strips = plots.map((plot) => new Strip(plot));
  $("strips").replaceChildren(...strips.map(({ canvas }) => canvas));
  speed ??= usual;
  $("speed").replaceChildren(
    ...choice(SPEEDS, speed, (key) => {
      speed = key;
      worker.postMessage({ kind: "speed", speed });
    }),
  );
  start();
}

function start() {
  clearTimeout(next);
  worker?.terminate();
  worker = new Worker(blob);
  worker.onmessage = ({ data }) => take(data);
  worker.onerror = ({ message }) => seen.errors.push(message);
  rows = [];
  last = seen.state = null;
  drawings = 0;
  $("console").replaceChildren();
  pause(false);
  worker.postMessage({ kind: "speed", speed });
  worker.postMessage({ kind: "start", loop: kind, policy, seed, settings: scaled() });
}

function pause(on) {
  paused = on;
  $("pause").textContent = on ? "Go on" : "Pause";
  $("pause").setAttribute("aria-pressed", String(on));
  worker.postMessage({ kind: "pause", paused });
  redraw();
}

function take(state) {
  rows.push(...state.rows);
  last = state;
  seen.state = { kind, policy, time: state.time, spent: state.spent, ...state.compared };
  for (const line of state.lines) {
    const className = /^\$(PING|SENSE|READY)/.test(line) ? "ask" : /^\$(STEER|AUV|MIS)/.test(line) ? "tell" : "";
    $("console").append(element("span", { className, textContent: line }));
  }
  while ($("console").childElementCount > LINES) $("console").firstChild.remove();
  if (state.done) {
    seen.runs.push({ ...seen.state, rows: rows.length });
    seed += 1;
    next = setTimeout(start, REST * 1000);
  }
  if (!pending) setTimeout(() => requestAnimationFrame(draw), FRAME);
  pending = true;
}

const count = new Intl.NumberFormat("en");

function draw() {
  pending = false;
  if (last === null) return;
  const { compared } = last;
  document.querySelector(".agreement").classList.toggle("differ", compared.differing > 0);
  $("differing").textContent = count.format(compared.differing);
  $("numbers").textContent = `of ${count.format(32 * compared.numbers)} compared in this run`;
  $("pairs").replaceChildren(
    ...KINDS[kind].pairs.map(([name, label]) => {
      const [chip, wasm] = (last.pairs[name] ?? [null, null]).map((word) =>
        word === null ? "\u2013" : word.toString(16).padStart(8, "0"),
      );
      const className = chip === wasm ? "" : "other";
      const cells = [label, chip, wasm].map((textContent) => element("td", { className, textContent }));
      return element("tr", {}, ...cells);
    }),
  );
  $("awake").textContent = `${(100 * last.awake).toFixed(1)} %`;
  $("cycles").textContent = `${(last.cycles / 1e6).toFixed(0)} M`;
  $("flash").textContent = `${(last.flash / 1024).toFixed(1)} KB`;
  $("factor").textContent = `${(last.time / last.spent).toFixed(0)}\u00d7 real time`;
  $("clock").textContent = last.done ? `${last.time.toFixed(1)} s: done` : `${last.time.toFixed(1)} s`;
  KINDS[kind].map(clear($("map")), rows, last);
  if (drawings % PLOTTED === 0 || last.done || paused) for (const strip of strips) strip.draw(rows);
  drawings += 1;
}

/** All of it, plots too. */
function redraw() {
  drawings = 0;
  draw();
}

function checked(result) {
  seen.checked = result;
  const { samples, wanted, numbers, onChip, inWasm, selfTest } = result;
  const whole = samples === wanted;
  const items = [
    [whole && onChip === 0, `chip = desk: ${numbers} stored numbers, ${onChip} bits differ`],
    [whole && inWasm === 0, `WebAssembly = desk: ${inWasm} bits differ`],
    [selfTest === 0, "self-test of the arithmetic"],
  ];
  $("checked").replaceChildren(
    ...items.map(([good, textContent]) => element("li", { className: good ? "" : "failed", textContent })),
  );
}

$("pause").onclick = () => pause(!paused);
$("again").onclick = () => {
  seed += 1;
  start();
};
for (const tab of document.querySelectorAll("nav button")) {
  tab.onclick = () => {
    kind = tab.dataset.kind;
    speed = null;
    show();
  };
}
addEventListener("resize", redraw);

const checker = new Worker(blob);
checker.onmessage = ({ data }) => {
  checked(data);
  checker.terminate();
};
checker.postMessage({ kind: "check" });
show();
