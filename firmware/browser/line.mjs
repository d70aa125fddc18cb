// Lines as the sketches write and read them: $body*hhhhhhhh with the CRC-32 of the body.
// (auvest/board/line.hpp, python/auvest/telemetry.py)

function checksumOf(body) {
  let sum = 0xffffffff;
  for (let i = 0; i < body.length; ++i) {
    sum ^= body.charCodeAt(i);
    for (let bit = 0; bit < 8; ++bit) sum = (sum >>> 1) ^ (sum & 1 ? 0xedb88320 : 0);
  }
  return (~sum >>> 0).toString(16).padStart(8, "0");
}

export const frame = (body) => `$${body}*${checksumOf(body)}`;

/** The fields of a line's body; null if it is not whole. */
export function fieldsOf(line) {
  const match = /^\$([^$*]*)\*([0-9a-f]{8})$/.exec(line);
  return match !== null && checksumOf(match[1]) === match[2] ? match[1].split(",") : null;
}

/** Names columns, and then reads the samples that have them. */
export class Columns {
  constructor(kind) {
    this.kind = kind;
    this.names = [];
  }

  /** A sample: whole numbers, and of floats their bits; null for what is empty. */
  read(fields) {
    if (fields[0] === "COLUMNS" && fields[1] === this.kind) this.names = fields.slice(2);
    if (fields[0] !== this.kind) return null;
    const row = {};
    this.names.forEach((name, i) => {
      const field = fields[i + 1];
      const whole = name.endsWith("#");
      const value = /^[0-9a-f]{8}$/.test(field) && !whole ? parseInt(field, 16) : Number(field);
      row[name.replace("#", "")] = field === "" ? null : value;
    });
    return row;
  }
}

const view = new DataView(new ArrayBuffer(4));

/** The float of these bits. */
export function floatOf(bits) {
  view.setUint32(0, bits);
  return view.getFloat32(0);
}

/** The bits of the float next to a number. */
export function bitsOf(number) {
  view.setFloat32(0, number);
  return view.getUint32(0);
}

/** How many bits differ between two words. */
export function differing(a, b) {
  let count = 0;
  for (let bits = (a ^ b) >>> 0; bits !== 0; bits &= bits - 1) ++count;
  return count;
}
