// Chip and world, away from the page: it draws while they run.
import missionBudget from "made/mission_budget.bin";
import missionFixed from "made/mission_fixed.bin";
import trackingBudget from "made/tracking_budget.bin";
import trackingFixed from "made/tracking_fixed.bin";
import trackingLaw from "made/tracking_law.bin";
import { check } from "./check.mjs";
import { LINES } from "./lines_shown.mjs";
import { Mission } from "./mission.mjs";
import { Tracking } from "./tracking.mjs";
import { World } from "./world.mjs";

const LOOPS = {
  tracking: { Loop: Tracking, programs: [trackingLaw, trackingBudget, trackingFixed] },
  mission: { Loop: Mission, programs: [missionFixed, missionBudget] },
};

const SLICE = 0.02; // simulated at once [s]
const BUSY = 25; // of the computer's time between two messages [ms]
const PAUSE = 8; // where the chip is ahead of its time [ms]

let loop = null;
let flash = 0;
let speed = 1; // times real time; 0: as fast as it goes
let paused = false;
let ahead = { real: 0, simulated: 0 }; // since when the chip's time follows the computer's
let spent = 0; // of the computer's time on this run [ms]

function follow() {
  ahead = { real: performance.now(), simulated: loop === null ? 0 : loop.chip.time };
}

function start({ loop: name, policy, seed, settings }) {
  const { Loop, programs } = LOOPS[name];
  loop = new Loop(new World(), programs[policy], policy, seed);
  flash = programs[policy].length;
  loop.set(settings);
  spent = 0;
  follow();
}

function run() {
  const began = performance.now();
  const due = speed === 0 ? Infinity : ahead.simulated + ((began - ahead.real) / 1000) * speed;
  while (!loop.done && loop.chip.time < due && performance.now() - began < BUSY) {
    loop.chip.run(Math.min(loop.chip.time + SLICE, due));
  }
  // What it cannot keep up with is not made up for later.
  if (loop.chip.time < due && speed !== 0) follow();
  spent += performance.now() - began;
}

function report() {
  const { chip, tally, rows, lines, done } = loop;
  postMessage({
    kind: "state",
    rows: rows.splice(0),
    lines: lines.splice(0).slice(-LINES),
    done,
    time: chip.time,
    awake: 1 - chip.asleep / chip.cpu.cycles,
    cycles: chip.cpu.cycles,
    flash,
    spent: spent / 1000,
    pairs: tally.pairs,
    compared: { numbers: tally.numbers, differing: tally.differing, first: tally.first },
  });
}

// A message to itself lets those of the page through, and comes at once.
const { port1, port2 } = new MessageChannel();
port1.onmessage = step;
let waiting = false;

function soon() {
  if (waiting) return;
  waiting = true;
  if (speed === 0) port2.postMessage(null);
  else setTimeout(step, PAUSE);
}

function step() {
  waiting = false;
  if (loop === null || paused || loop.done) return;
  run();
  report();
  soon();
}

onmessage = ({ data }) => {
  if (data.kind === "check") {
    postMessage({ kind: "checked", ...check(new World(), trackingLaw) });
    return;
  }
  if (data.kind === "start") start(data);
  if (data.kind === "set") loop?.set(data.settings);
  if (data.kind === "speed") speed = data.speed;
  if (data.kind === "pause") paused = data.paused;
  follow();
  soon();
};
