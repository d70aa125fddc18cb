/** The bytes of a program, of a file of Intel's hexadecimal records. */
export function bytesOf(text) {
  const bytes = [];
  let base = 0;
  for (const line of text.split("\n")) {
    if (!line.startsWith(":")) continue;
    const record = Buffer.from(line.slice(1).trim(), "hex");
    if (record.reduce((sum, byte) => sum + byte, 0) & 0xff) throw new Error(`checksum of ${line}`);
    const [count, , , kind] = record;
    const content = record.subarray(4, 4 + count);
    if (kind === 0) content.forEach((byte, i) => (bytes[base + record.readUInt16BE(1) + i] = byte));
    if (kind === 2) base = content.readUInt16BE(0) << 4;
    if (kind === 4) base = content.readUInt16BE(0) << 16;
  }
  return Uint8Array.from(bytes, (byte) => byte ?? 0xff);
}
