// The sketch tracking_loop, and at the other end of its line a sonar and the vehicle it measures.
import { floatOf, frame } from "./line.mjs";
import { Session } from "./session.mjs";

/** Columns whose bits are compared, in the order of the words of world.cpp. */
export const COMPARED = [
  ...["x_m", "y_m", "vx_m_s", "vy_m_s", "ax_m_s2", "ay_m_s2"],
  ...["P00_m2", "P10_m2", "P11_m2", "nis", "interval_s"],
];
const NIS = COMPARED.indexOf("nis");
const STATUS = COMPARED.length;
const SIGN = 0x80000000;
const TICKS = 250_000; // in a second, of the sketch's clock

const FIRST_INTERVAL = 0.5; // the track begins so long before the first sample [s]
const PROCESSING = 2e-3; // what the sonar takes besides the way of the sound [s]
const SOUND = 1500; // [m/s]
const LENGTH = 60; // of a run [s]

/** The sketch's estimator as WebAssembly, fed what the chip was fed. */
export class TrackingTwin {
  constructor(world) {
    this.world = world;
  }

  /** The bits of a sample's numbers; null where the chip sends none. */
  step(row, answer) {
    const { world } = this;
    world.words.set([Math.round(row.time_s * TICKS), row.dt_s]);
    if (row.range_m !== null) world.text = answer;
    world.calls.tracking_step(row.sample, row.range_m !== null);
    const words = Array.from(world.words.subarray(0, STATUS + 1));
    if (words[NIS] & SIGN) words[NIS] = null; // below 0: the filter has not looked at it
    return words;
  }
}

export class Tracking extends Session {
  /** `policy` is the number of the interval policy that the program has. */
  constructor(world, program, policy, seed) {
    super(world, program, "AUV");
    this.start = null;
    this.triggered = 0;
    this.asked = new Map(); // by sample: what is true, and the answer
    this.twin = new TrackingTwin(world);
    world.calls.tracking_start(seed, policy);
    this.chip.onTrigger = (time) => (this.triggered = time);
  }

  /** Times what the filter expects; probability; how far the vehicle swings out [m]. */
  set({ noise, outliers, wander }) {
    this.world.calls.tracking_set(noise, outliers, wander);
  }

  react(fields, time) {
    if (fields[0] === "PING") this.answer(Number(fields[1]), time);
  }

  answer(sample, time) {
    this.start ??= this.triggered - FIRST_INTERVAL;
    const outlier = this.world.calls.tracking_measure(this.triggered - this.start) !== 0;
    const [x, y, wantedX, wantedY, range, bearing, distance] = this.world.numbers;
    const body = `SONAR,${sample},${range.toFixed(6)},${bearing.toFixed(6)}`;
    this.asked.set(sample, { x, y, wantedX, wantedY, range, bearing, outlier, body });
    this.chip.send(frame(body), Math.max(time, this.triggered + PROCESSING + (2 * distance) / SOUND));
  }

  take(row) {
    const truth = this.asked.get(row.sample);
    this.asked.delete(row.sample);
    const words = this.twin.step(row, truth.body);
    COMPARED.forEach((name, i) => this.tally.compare(name, row[name], words[i]));
    this.tally.compare("status", row.status, words[STATUS]);
    const shown = { ...truth, time: row.time_s, status: row.status };
    for (const name of COMPARED) shown[name] = row[name] === null ? NaN : floatOf(row[name]);
    this.rows.push(shown);
    this.done = shown.time >= LENGTH;
  }
}
