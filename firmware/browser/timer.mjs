// A timer that wakes the simulation only when something happens: at a compare or an overflow. (The
// one of avr8js has an event for every tick, which takes longer than the program.)
//
// It counts up from 0 to its top and around, as in normal mode; so does Arduino's millis() with the
// fast PWM of timer 0. Pins are not driven.

const FLAGS = { overflow: 0x01, compareA: 0x02, compareB: 0x04 };

export class Timer {
  /** `registers` and `vectors` (word addresses) are those of avr8js's configurations. */
  constructor(cpu, registers) {
    this.cpu = cpu;
    this.registers = registers;
    this.wide = registers.bits === 16;
    this.period = this.wide ? 0x10000 : 0x100;
    this.divider = 0; // cycles of a tick; 0: it stands
    this.began = 0; // the cycle at which it counted `first`
    this.first = 0;
    this.settled = 0; // the count up to which flags are set; not wrapped, as `first`
    this.temporary = 0; // the high byte of what is written to a register of 16 bits
    this.armed = false;
    const interrupt = (mask, address) => ({
      address,
      flagRegister: registers.TIFR,
      flagMask: mask,
      enableRegister: registers.TIMSK,
      enableMask: mask,
    });
    this.interrupts = [
      interrupt(FLAGS.overflow, registers.ovfInterrupt),
      interrupt(FLAGS.compareA, registers.compAInterrupt),
      interrupt(FLAGS.compareB, registers.compBInterrupt),
    ];
    this.wake = () => {
      this.armed = false;
      this.settle();
      this.arm();
    };
    this.listen();
  }

  listen() {
    const { cpu, registers: at, wide } = this;
    const { data, readHooks, writeHooks } = cpu;
    readHooks[at.TCNT] = () => {
      const count = this.count() % this.period;
      if (wide) data[at.TCNT + 1] = count >> 8;
      return (data[at.TCNT] = count & 0xff);
    };
    writeHooks[at.TCNT] = (low) => {
      this.settle();
      this.restart(wide ? (this.temporary << 8) | low : low);
      return false;
    };
    for (const register of [at.OCRA, at.OCRB]) {
      writeHooks[register] = (low) => {
        this.settle();
        data[register] = low;
        if (wide) data[register + 1] = this.temporary;
        this.arm();
        return true;
      };
    }
    if (wide) {
      for (const register of [at.TCNT, at.OCRA, at.OCRB]) {
        writeHooks[register + 1] = (high) => {
          this.temporary = high;
          return true;
        };
      }
    }
    writeHooks[at.TCCRB] = (value) => {
      this.settle();
      const count = this.count();
      this.divider = at.dividers[value & 7];
      this.restart(count % this.period);
      return false;
    };
    readHooks[at.TIFR] = () => {
      this.settle();
      return data[at.TIFR];
    };
    writeHooks[at.TIFR] = (ones) => {
      this.settle();
      for (const interrupt of this.interrupts) {
        if (ones & interrupt.flagMask) cpu.clearInterrupt(interrupt);
      }
      return true;
    };
    writeHooks[at.TIMSK] = (value) => {
      this.settle();
      for (const interrupt of this.interrupts) cpu.updateInterruptEnable(interrupt, value);
      return false;
    };
  }

  /** Ticks since it began at 0, not wrapped. */
  count() {
    if (this.divider === 0) return this.first;
    return this.first + Math.floor((this.cpu.cycles - this.began) / this.divider);
  }

  restart(count) {
    this.began = this.cpu.cycles;
    this.first = this.settled = count;
    this.arm();
  }

  /** Counts at which a flag is set, in the order of `interrupts`. */
  marks() {
    const { data } = this.cpu;
    const { OCRA, OCRB } = this.registers;
    const compare = (at) => (this.wide ? data[at] | (data[at + 1] << 8) : data[at]);
    return [0, compare(OCRA), compare(OCRB)];
  }

  /** How many ticks from a count to the next at which a mark is met, at least one. */
  ticksTo(mark, count) {
    const ahead = (mark - (count % this.period) + this.period) % this.period;
    return ahead === 0 ? this.period : ahead;
  }

  /** Sets the flags of what has passed. */
  settle() {
    const now = this.count();
    if (now === this.settled) return;
    this.marks().forEach((mark, i) => {
      if (this.settled + this.ticksTo(mark, this.settled) <= now) {
        this.cpu.setInterruptFlag(this.interrupts[i]);
      }
    });
    this.settled = now;
  }

  /** Sets the alarm for the next mark. */
  arm() {
    if (this.armed) this.cpu.clearClockEvent(this.wake);
    this.armed = this.divider !== 0;
    if (!this.armed) return;
    const now = this.count();
    const ahead = Math.min(...this.marks().map((mark) => this.ticksTo(mark, now)));
    const at = this.began + (now + ahead - this.first) * this.divider;
    this.cpu.addClockEvent(this.wake, at - this.cpu.cycles);
  }
}
