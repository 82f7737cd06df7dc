// A zip of files that are stored without compression, as APPNOTE.TXT of PKWARE describes it. Pure: no DOM.

const LOCAL = 0x04034b50;
const CENTRAL = 0x02014b50;
const END = 0x06054b50;
const VERSION = 20; // 2.0: folders, and nothing newer.
const UTF8 = 0x0800; // Names are UTF-8.
const DATE = 0x21; // The first day of 1980, so that the same files give the same zip.
const MOST = 0xffff; // A zip without extensions has no more files.

const TABLE = Uint32Array.from({ length: 256 }, (_, byte) => {
  let rest = byte;
  for (let bit = 0; bit < 8; bit++) rest = rest & 1 ? 0xedb88320 ^ (rest >>> 1) : rest >>> 1;
  return rest;
});

export function crc32(bytes) {
  let rest = ~0;
  for (const byte of bytes) rest = TABLE[(rest ^ byte) & 0xff] ^ (rest >>> 8);
  return ~rest >>> 0;
}

// `files` are {name, bytes}; returns the parts of the zip.
export function zipOf(files) {
  if (files.length > MOST) throw new RangeError(`expected at most ${MOST} files, got ${files.length}`);
  const parts = [];
  const entries = [];
  let place = 0;
  for (const { name, bytes } of files) {
    const utf8 = new TextEncoder().encode(name);
    const about = [VERSION, UTF8, 0, 0, DATE, [crc32(bytes)], [bytes.length], [bytes.length], utf8.length, 0];
    entries.push(record([[CENTRAL], VERSION, ...about, 0, 0, 0, [0], [place]]), utf8);
    const head = record([[LOCAL], ...about]);
    parts.push(head, utf8, bytes);
    place += head.length + utf8.length + bytes.length;
  }
  const size = entries.reduce((sum, { length }) => sum + length, 0);
  const end = record([[END], 0, 0, files.length, files.length, [size], [place], 0]);
  return [...parts, ...entries, end];
}

// Numbers of two bytes, or of four bytes where they stand in brackets; the least byte first.
function record(numbers) {
  const bytes = numbers.flatMap((one) => (Array.isArray(one) ? fourOf(one[0]) : [one & 0xff, one >>> 8]));
  return Uint8Array.from(bytes);
}

const fourOf = (number) => [0, 8, 16, 24].map((shift) => (number >>> shift) & 0xff);
