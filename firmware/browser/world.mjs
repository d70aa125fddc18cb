// The WebAssembly of world.cpp, which says what is in its numbers and words.
import wasm from "made/world.wasm";

export class World {
  constructor() {
    this.calls = new WebAssembly.Instance(new WebAssembly.Module(wasm)).exports;
    this.calls._initialize();
  }

  // Views are made anew for each use: one is void when the memory grows.
  get numbers() {
    return new Float64Array(this.calls.memory.buffer, this.calls.numbers(), 16);
  }
  get words() {
    return new Uint32Array(this.calls.memory.buffer, this.calls.words(), 16);
  }
  set text(text) {
    const bytes = new Uint8Array(this.calls.memory.buffer, this.calls.text(), 64);
    for (let i = 0; i < text.length; ++i) bytes[i] = text.charCodeAt(i);
    bytes[text.length] = 0;
  }
}
