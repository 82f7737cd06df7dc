// CBOR (RFC 8949): texts, numbers, bytes, lists and objects, each with its length before it.

const BYTES = 2;
const TEXT = 3;
const LIST = 4;
const MAP = 5;
const TAG = 6;
const SIMPLE = 7;
const SIMPLES = { 20: false, 21: true, 22: null, 23: undefined };
const MOST_DEPTH = 16;

export function encode(value) {
  const parts = [];
  put(value, parts);
  const bytes = new Uint8Array(parts.reduce((sum, part) => sum + part.length, 0));
  let at = 0;
  for (const part of parts) {
    bytes.set(part, at);
    at += part.length;
  }
  return bytes;
}

function put(value, parts) {
  if (value === null) parts.push(head(SIMPLE, 22));
  else if (typeof value === "boolean") parts.push(head(SIMPLE, value ? 21 : 20));
  else if (typeof value === "number") parts.push(numberOf(value));
  else if (typeof value === "string") {
    const text = new TextEncoder().encode(value);
    parts.push(head(TEXT, text.length), text);
  } else if (value instanceof Uint8Array) parts.push(head(BYTES, value.length), value);
  else if (Array.isArray(value)) {
    parts.push(head(LIST, value.length));
    for (const each of value) put(each, parts);
  } else {
    const entries = Object.entries(value);
    parts.push(head(MAP, entries.length));
    for (const each of entries.flat()) put(each, parts);
  }
}

const isShort = (value) => Number.isInteger(value) && Math.abs(value) < 2 ** 32 && !Object.is(value, -0);

function numberOf(value) {
  if (isShort(value)) return value < 0 ? head(1, -1 - value) : head(0, value);
  const bytes = new Uint8Array(9);
  bytes[0] = (SIMPLE << 5) | 27;
  new DataView(bytes.buffer).setFloat64(1, value);
  return bytes;
}

// The kind of a value, and its length or value below 2 ** 32.
function head(kind, size) {
  const first = kind << 5;
  if (size < 24) return Uint8Array.of(first | size);
  if (size < 2 ** 8) return Uint8Array.of(first | 24, size);
  if (size < 2 ** 16) return Uint8Array.of(first | 25, size >> 8, size & 255);
  return Uint8Array.of(first | 26, size >>> 24, (size >> 16) & 255, (size >> 8) & 255, size & 255);
}

// Throws if the bytes are cut or of a kind that is not known.
export function decode(bytes) {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const [value, end] = read(view, 0, 0);
  if (end !== bytes.length) throw new RangeError(`expected ${end} bytes, got ${bytes.length}`);
  return value;
}

// Returns the value at a place, and the place after it.
function read(view, at, depth) {
  if (depth > MOST_DEPTH) throw new RangeError(`expected at most ${MOST_DEPTH} levels`);
  const first = view.getUint8(at);
  const [kind, short] = [first >> 5, first & 31];
  if (kind === SIMPLE) return simpleAt(view, at, short);
  const [size, start] = sizeAt(view, at, short);
  if (kind === 0) return [size, start];
  if (kind === 1) return [-1 - size, start];
  if (kind === TAG) return read(view, start, depth + 1);
  if (kind === BYTES || kind === TEXT) {
    if (start + size > view.byteLength) throw new RangeError(`expected ${size} bytes at ${start}`);
    const part = new Uint8Array(view.buffer, view.byteOffset + start, size);
    return [kind === TEXT ? new TextDecoder().decode(part) : part, start + size];
  }
  const found = [];
  let next = start;
  for (let left = kind === MAP ? 2 * size : size; left > 0; left--) {
    const [value, end] = read(view, next, depth + 1);
    found.push(value);
    next = end;
  }
  if (kind === LIST) return [found, next];
  const pairs = found.flatMap((name, place) => (place % 2 ? [] : [[name, found[place + 1]]]));
  return [Object.fromEntries(pairs), next];
}

function sizeAt(view, at, short) {
  if (short < 24) return [short, at + 1];
  if (short === 24) return [view.getUint8(at + 1), at + 2];
  if (short === 25) return [view.getUint16(at + 1), at + 3];
  if (short === 26) return [view.getUint32(at + 1), at + 5];
  if (short === 27) return [Number(view.getBigUint64(at + 1)), at + 9];
  throw new RangeError(`expected a length at ${at}`);
}

function simpleAt(view, at, short) {
  if (short in SIMPLES) return [SIMPLES[short], at + 1];
  if (short === 25) return [halfOf(view.getUint16(at + 1)), at + 3];
  if (short === 26) return [view.getFloat32(at + 1), at + 5];
  if (short === 27) return [view.getFloat64(at + 1), at + 9];
  throw new RangeError(`expected a value at ${at}`);
}

function halfOf(bits) {
  const [sign, exponent, part] = [bits >> 15 ? -1 : 1, (bits >> 10) & 31, bits & 1023];
  if (exponent === 31) return part ? NaN : sign * Infinity;
  return sign * (exponent ? 2 ** (exponent - 25) * (1024 + part) : 2 ** -24 * part);
}
