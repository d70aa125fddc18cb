// node replay.mjs PROGRAM RECORD TRACE: a program over board.hpp takes its record from a file, and
// what it writes goes into another. It needs nothing else of its host, not even WASI.
import { readFileSync, writeFileSync } from "node:fs";

const [program, from, to] = process.argv.slice(2);
const record = readFileSync(from);
let trace = new Uint8Array(1 << 16);
let taken = 0;
let written = 0;
let finished = false;

const board = {
  read() {
    if (taken === record.length) throw new Error(`${from} ends early`);
    return record[taken++];
  },
  write(byte) {
    if (written === trace.length) {
      const longer = new Uint8Array(2 * written);
      longer.set(trace);
      trace = longer;
    }
    trace[written++] = byte;
  },
  finish() {
    finished = true;
  },
  fail() {
    throw new Error("the program found a fault");
  },
};

const { instance } = await WebAssembly.instantiate(readFileSync(program), { board });
instance.exports._initialize();
instance.exports.main();
if (!finished) throw new Error("the program did not finish");
if (taken !== record.length) throw new Error(`${record.length - taken} bytes of ${from} are left`);
writeFileSync(to, trace.subarray(0, written));
