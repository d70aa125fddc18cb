// An ATmega2560 out of avr8js: the core is its, and here is what this chip has beside, as far as
// the sketches use it. Vectors, registers and memory are those of the datasheet.
import {
  AVREEPROM,
  AVRUSART,
  CPU,
  EEPROMMemoryBackend,
  avrInstruction,
  eepromConfig,
  timer0Config,
  timer1Config,
  usart0Config,
} from "avr8js";
import { Timer } from "./timer.mjs";

export const FREQUENCY = 16e6;
export const FLASH_BYTES = 256 << 10;
const RAM_BYTES = 8 << 10;
const EEPROM_BYTES = 4 << 10;
// Registers end at 0x1ff on this chip, at 0xff on those that avr8js has in mind.
const FURTHER_REGISTERS = 0x100;

const MCUSR = 0x54;
const POWER_CAME_ON = 1;
const SMCR = 0x53; // whether SLEEP sleeps
const PORTH = 0x102;
const TRIGGER = 1 << 5; // D8 of the board
const SLEEP = 0x9588;
const SEI = 0x9478;

// The address of a vector by its number in the datasheet, less one: a JMP takes two words.
const vector = (number) => 2 * number;

const TIMER_0 = {
  ...timer0Config,
  compAInterrupt: vector(21),
  compBInterrupt: vector(22),
  ovfInterrupt: vector(23),
};
const TIMER_1 = {
  ...timer1Config,
  compAInterrupt: vector(17),
  compBInterrupt: vector(18),
  ovfInterrupt: vector(20),
};
const SERIAL = {
  ...usart0Config,
  rxCompleteInterrupt: vector(25),
  dataRegisterEmptyInterrupt: vector(26),
  txCompleteInterrupt: vector(27),
};
const EEPROM = { ...eepromConfig, eepromReadyInterrupt: vector(30) };

export class Chip {
  /** `program` has the bytes of the flash from address 0 on. */
  constructor(program) {
    // With so much flash avr8js has program counters of 22 bits, as this chip.
    const flash = new Uint8Array(FLASH_BYTES).fill(0xff);
    flash.set(program);
    this.cpu = new CPU(new Uint16Array(flash.buffer), RAM_BYTES + FURTHER_REGISTERS);
    const { cpu } = this;
    // As long as the memory: what has no hook is then as quick to find as what has one.
    cpu.readHooks = new Array(cpu.data.length).fill(null);
    cpu.writeHooks = new Array(cpu.data.length).fill(null);
    this.timers = [new Timer(cpu, TIMER_0), new Timer(cpu, TIMER_1)];
    this.eeprom = new AVREEPROM(cpu, new EEPROMMemoryBackend(EEPROM_BYTES), EEPROM);
    this.serial = new AVRUSART(cpu, SERIAL, FREQUENCY);
    this.asleep = 0; // cycles
    this.lineFree = 0; // the cycle at which the line to the chip has sent what it was given

    /** Given a line without its end, and the time at which its last bit was sent [s]. */
    this.onLine = () => {};
    /** Given the time at which the trigger's pin goes high [s]. */
    this.onTrigger = () => {};

    let line = "";
    this.serial.onByteTransmit = (byte) => {
      const character = String.fromCharCode(byte);
      if (character === "\n") {
        this.onLine(line, (cpu.cycles + this.serial.cyclesPerChar) / FREQUENCY);
        line = "";
      } else if (character !== "\r") {
        line += character;
      }
    };
    cpu.writeHooks[PORTH] = (value, before) => {
      if (value & ~before & TRIGGER) this.onTrigger(cpu.cycles / FREQUENCY);
      return false;
    };
    cpu.data[MCUSR] = POWER_CAME_ON;
  }

  get time() {
    return this.cpu.cycles / FREQUENCY;
  }

  /** Sends a line to the chip, character by character, from this time on or as soon as it can. */
  send(line, from = 0) {
    const { cpu, serial } = this;
    let at = Math.max(cpu.cycles, from * FREQUENCY, this.lineFree);
    for (const character of `${line}\n`) {
      at += serial.cyclesPerChar;
      const byte = character.charCodeAt(0);
      cpu.addClockEvent(() => serial.writeByte(byte, true), at - cpu.cycles);
    }
    this.lineFree = at;
  }

  /** Runs until this time [s]. */
  run(until) {
    const { cpu } = this;
    const { progMem } = cpu;
    const end = until * FREQUENCY;
    while (cpu.cycles < end) {
      const instruction = progMem[cpu.pc];
      if (instruction === SLEEP) {
        this.sleep(end);
        continue;
      }
      avrInstruction(cpu);
      // What follows SEI is done before an interrupt: so SEI, SLEEP misses none.
      if (instruction === SEI) continue;
      const event = cpu.nextClockEvent;
      if (cpu.nextInterrupt >= 0 || (event !== null && event.cycles <= cpu.cycles)) cpu.tick();
    }
  }

  /** SLEEP, which avr8js takes for nothing: time jumps to what wakes the chip. */
  sleep(end) {
    const { cpu } = this;
    if (cpu.data[SMCR] & 1) {
      const before = cpu.cycles;
      while (cpu.nextInterrupt < 0) {
        const event = cpu.nextClockEvent;
        if (event === null || event.cycles > end) {
          cpu.cycles = Math.ceil(end);
          this.asleep += cpu.cycles - before;
          return; // it goes on to sleep when it runs again
        }
        cpu.cycles = Math.max(cpu.cycles, event.cycles);
        event.callback();
        cpu.nextClockEvent = event.next;
      }
      this.asleep += cpu.cycles - before;
    }
    cpu.pc += 1;
    cpu.cycles += 1;
    cpu.tick();
  }
}
