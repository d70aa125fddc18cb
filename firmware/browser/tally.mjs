import { differing } from "./line.mjs";

/** Counts what is compared bit by bit, and what differs. */
export class Tally {
  constructor() {
    this.numbers = 0;
    this.differing = 0; // bits
    this.first = null; // the first number that differs: its name
    this.pairs = {}; // the last of each name
  }

  /** `null` is a number that is not there. */
  compare(name, one, other) {
    this.numbers += 1;
    this.pairs[name] = [one, other];
    if (one === other) return;
    this.differing += one === null || other === null ? 32 : differing(one, other);
    this.first ??= name;
  }
}
