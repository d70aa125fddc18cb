// The sketch mission, and at the other end of its line the vehicle that it steers.
import { bitsOf, floatOf, frame } from "./line.mjs";
import { Session } from "./session.mjs";

const PERIOD = 0.1; // [s]
const FROM_REST = [0, 0, 15].map(bitsOf); // rudder, planes, propeller before the first command
const FINISHED = 2; // of PilotMode (auvest/mission/pilot.hpp)

const COMMAND = ["rudder_rad", "planes_rad", "propeller_rev_s"];
/** Columns of its telemetry, in the order of the words of world.cpp behind the command. */
const COMPARED = [
  ...["x_m", "y_m", "current_x_m_s", "current_y_m_s", "P00_m2", "P10_m2", "P11_m2"],
  ...["heading_rad", "cross_m", "nis"],
];
const WORDS = COMMAND.length + COMPARED.length;

export class Mission extends Session {
  /** `policy` is the number of the interval policy that the program has. */
  constructor(world, program, policy, seed) {
    super(world, program, "MISSION");
    this.sample = 0;
    this.row = null; // of the sample
    this.requested = 0; // when the sample was asked for [s]
    this.held = FROM_REST; // the command that acts
    this.command = null; // of the sample
    this.delay = PERIOD; // from the request to the command [s]
    this.wanted = []; // by the twin, of the last samples
    this.begun = false;
    world.calls.mission_start(seed, policy);
    const [x, y, heading] = world.numbers;
    this.startBody = `START,${x.toFixed(4)},${y.toFixed(4)},${heading.toFixed(6)}`;
  }

  /** Times what the filter expects; probability; the current [m/s] and where it goes [rad]. */
  set({ noise, outliers, current, towards }) {
    this.world.calls.mission_set(noise, outliers, current, towards);
  }

  react(fields, time) {
    if (fields[0] === "READY") this.begin(time);
    if (fields[0] === "SENSE") this.sense(Number(fields[1]), fields[2] === "1", time);
    if (fields[0] === "STEER") this.steer(Number(fields[1]), fields.slice(2), time);
  }

  begin(time) {
    if (!this.begun) {
      this.world.text = this.startBody;
      this.world.calls.mission_begin();
      this.begun = true;
    }
    this.chip.send(frame(this.startBody), time);
  }

  sense(sample, ping, time) {
    this.advance();
    const { world } = this;
    this.sample = sample;
    this.requested = time;
    this.tally.compare("ping", Number(ping), world.calls.mission_wants_fix());
    const fixed = world.calls.mission_sense(ping) !== 0;
    const [heading, pitch, q, r, u, v, depth, range, bearing] = world.numbers;
    const lines = [
      `COMPASS,${sample},${heading.toFixed(5)},${pitch.toFixed(5)}`,
      `GYRO,${sample},${q.toFixed(5)},${r.toFixed(5)}`,
      `LOG,${sample},${u.toFixed(4)},${v.toFixed(4)}`,
      `DEPTH,${sample},${depth.toFixed(3)}`,
    ];
    // As a vehicle's modem would: what it was asked for first comes first.
    if (fixed) lines.unshift(`FIX,${sample},${range.toFixed(3)},${bearing.toFixed(5)},0.0000`);
    for (const body of lines) {
      world.text = body;
      world.calls.mission_hear(sample);
      this.chip.send(frame(body), time);
    }
    world.calls.mission_look();
    const [x, y, , , , yaw, north, east] = world.numbers;
    const fix = fixed ? { x: range * Math.cos(bearing), y: range * Math.sin(bearing) } : null;
    this.row = { time: (sample - 1) * PERIOD, x, y, yaw, north, east, fix };
  }

  steer(sample, fields, time) {
    const { world } = this;
    world.calls.mission_step(sample);
    const words = Array.from(world.words.subarray(0, WORDS));
    this.command = fields.map((field) => parseInt(field, 16));
    this.delay = Math.min(time - this.requested, PERIOD);
    COMMAND.forEach((name, i) => this.tally.compare(name, this.command[i], words[i]));
    this.wanted = [...this.wanted.slice(-1), { sample, words }];
  }

  /** The world moves on by a period: the command before acts until the new one has come. */
  advance() {
    if (this.sample === 0) return;
    this.rows.push(this.row);
    const end = this.sample * PERIOD;
    const command = this.command ?? this.held;
    const delay = this.command === null ? PERIOD : this.delay;
    this.hold(this.held, delay, end - PERIOD + delay);
    this.hold(command, PERIOD - delay, end);
    this.held = command;
    this.command = null;
  }

  hold(command, span, until) {
    if (span <= 0) return;
    this.world.words.set(command);
    this.world.calls.mission_advance(span, until);
  }

  take(row) {
    const { words } = this.wanted.find(({ sample }) => sample === row.sample);
    COMPARED.forEach((name, i) => {
      if (row[name] !== null) this.tally.compare(name, row[name], words[COMMAND.length + i]);
    });
    const shown = { leg: row.leg, mode: row.mode, status: row.status, fixes: row.fixes };
    for (const name of COMPARED) shown[name] = row[name] === null ? NaN : floatOf(row[name]);
    shown.rudder_rad = floatOf(this.command[0]);
    this.row.told = shown; // its line ends before the next sample begins
    this.done = row.mode === FINISHED;
  }
}
