// The stored record (trace.py) once more: on the chip, and by the same C++ as WebAssembly.
import { Chip } from "./chip.mjs";
import { Columns, fieldsOf, frame } from "./line.mjs";
import { Tally } from "./tally.mjs";
import { COMPARED, TrackingTwin } from "./tracking.mjs";
import trace from "./trace.json";

const ANSWER = 5e-3; // after the request [s]
const ENOUGH = 120; // simulated seconds that only a chip that hangs takes

/** How many numbers were compared with the desk's, and how many bits differ, on each side. */
export function check(world, program) {
  const chip = new Chip(program);
  const columns = new Columns("AUV");
  const twin = new TrackingTwin(world);
  const onChip = new Tally();
  const inWasm = new Tally();
  let samples = 0;
  world.calls.tracking_start(1, 0);
  chip.onLine = (line, time) => {
    const fields = fieldsOf(line) ?? [];
    if (fields[0] === "PING") {
      chip.send(frame(trace.answers[Number(fields[1]) - 1]), time + ANSWER);
      return;
    }
    const row = columns.read(fields);
    if (row === null) return;
    const wanted = trace.words[samples];
    const words = twin.step(row, trace.answers[samples]);
    samples += 1;
    COMPARED.forEach((name, i) => {
      onChip.compare(name, row[name], wanted[i]);
      inWasm.compare(name, words[i], wanted[i]);
    });
  };
  while (samples < trace.answers.length && chip.time < ENOUGH) chip.run(chip.time + 0.05);
  return {
    samples,
    wanted: trace.answers.length,
    numbers: onChip.numbers,
    onChip: onChip.differing,
    inWasm: inWasm.differing,
    selfTest: world.calls.self_test(),
  };
}
