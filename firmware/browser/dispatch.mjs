// avr8js finds what an instruction is by a chain of a hundred questions. With the same questions
// asked once, of all 65,536 words, and the answers kept, the chip runs faster.
import { readFile } from "node:fs/promises";

const QUESTION = /^    (?:else )?if \(([^{]+)\) \{$/gm;
const BEHIND = "    cpu.pc = (cpu.pc + 1) % cpu.progMem.length;\n";

/** The text of avr8js's instruction.js, with a switch in place of the chain. */
export function withSwitch(text) {
  const begin = text.search(QUESTION);
  const end = text.indexOf(BEHIND);
  const chain = text.slice(begin, end);
  const questions = [];
  const cases = chain
    .replace(QUESTION, (_, question) => `    case ${questions.push(question)}: {`)
    .replaceAll(/^    \}$/gm, "    break; }");
  if (begin < 0 || end < 0 || questions.length < 90 || /\b(break|return)\b/.test(chain)) {
    throw new Error("avr8js has changed: its instructions are not a chain of questions any more");
  }
  const answers = questions.map((question, i) => `  if (${question}) return ${i + 1};\n`);
  return (
    `function kindOf(opcode) {\n${answers.join("")}  return 0;\n}\n` +
    "const KINDS = Uint8Array.from({ length: 0x10000 }, (_, opcode) => kindOf(opcode));\n" +
    `${text.slice(0, begin)}    switch (KINDS[opcode]) {\n${cases}    }\n${text.slice(end)}`
  );
}

/** A plugin of esbuild that loads it so. */
export const dispatch = {
  name: "dispatch",
  setup(build) {
    build.onLoad({ filter: /avr8js.dist.esm.cpu.instruction\.js$/ }, async ({ path }) => ({
      contents: withSwitch(await readFile(path, "utf8")),
    }));
  },
};
