// A sketch on the chip, and what hears and answers it at the other end of its line.
import { Chip } from "./chip.mjs";
import { Columns, fieldsOf } from "./line.mjs";
import { Tally } from "./tally.mjs";

/** Who derives from it says what the world does: `react(fields, time)` to a line, `take(row)` of telemetry. */
export class Session {
  /** `kind` begins the lines of telemetry. */
  constructor(world, program, kind) {
    this.world = world;
    this.chip = new Chip(program);
    this.tally = new Tally();
    this.rows = [];
    this.lines = [];
    this.done = false;
    this.columns = new Columns(kind);
    this.chip.onLine = (line, time) => this.hear(line, time);
  }

  hear(line, time) {
    this.lines.push(line);
    const fields = fieldsOf(line);
    if (fields === null) return;
    this.react(fields, time);
    const row = this.columns.read(fields);
    if (row !== null) this.take(row);
  }
}
