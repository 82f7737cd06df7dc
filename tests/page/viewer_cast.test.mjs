// The messages to the bridge of a Looking Glass panel, and the quilts that they carry.
import assert from "node:assert/strict";
import { test } from "node:test";
import { decode, encode } from "../../service/dashboard/static/viewer/cast/cbor.js";
import { answerOf, faultOf, requestOf, showOf } from "../../service/dashboard/static/viewer/cast/messages.js";
import { fileOfFrame, quiltOf, tileColumns } from "../../service/dashboard/static/viewer/cast/quilt.js";

const bytesOf = (hex) => Uint8Array.from(hex.match(/../g) ?? [], (pair) => parseInt(pair, 16));
const hexOf = (bytes) => Array.from(bytes, (byte) => byte.toString(16).padStart(2, "0")).join("");

// RFC 8949, Appendix A.
const BOTH_WAYS = [
  [0, "00"],
  [23, "17"],
  [24, "1818"],
  [1000, "1903e8"],
  [1000000, "1a000f4240"],
  [-1, "20"],
  [-1000, "3903e7"],
  [1.1, "fb3ff199999999999a"],
  [false, "f4"],
  [true, "f5"],
  [null, "f6"],
  ["", "60"],
  ["ü", "62c3bc"],
  [[1, [2, 3], [4, 5]], "8301820203820405"],
  [{ a: 1, b: [2, 3] }, "a26161016162820203"],
];

test("values become the bytes of the standard, and come back", () => {
  for (const [value, hex] of BOTH_WAYS) {
    assert.equal(hexOf(encode(value)), hex);
    assert.deepEqual(decode(bytesOf(hex)), value);
  }
  const long = { bin: new Uint8Array(70_000).fill(7) };
  assert.deepEqual(decode(encode(long)), long);
});

test("numbers that only others write are read, and what is cut, endless or too deep is refused", () => {
  const read = [
    ["f93e00", 1.5],
    ["f98000", -0],
    ["f90001", 5.960464477539063e-8],
    ["fa47c35000", 100000],
    ["1b000000e8d4a51000", 1000000000000],
    ["c074323031332d30332d32315432303a30343a30305a", "2013-03-21T20:04:00Z"],
  ];
  for (const [hex, value] of read) assert.equal(decode(bytesOf(hex)), value);
  for (const hex of ["", "19", "62c3", "8301", "9f01ff", "0000", "81".repeat(40) + "00"]) {
    assert.throws(() => decode(bytesOf(hex)), RangeError);
  }
});

test("a request has its number before it, and an answer says what went wrong", () => {
  const bytes = requestOf(0x80000001, showOf({ columns: 4, rows: 2, aspect: 0.75 }), Uint8Array.of(1, 2));
  const { number, answer } = answerOf(bytes.buffer);
  assert.equal(number, 0x80000001);
  assert.deepEqual(answer.cmd.show.quilt.settings, { vx: 4, vy: 2, vtotal: 8, aspect: 0.75 });
  assert.deepEqual(answer.bin, Uint8Array.of(1, 2));
  assert.equal(faultOf({ error: 0 }), "");
  assert.match(faultOf({ error: 4 }), /No Looking Glass panel/);
  assert.match(faultOf({ error: 0, devices: [] }), /No Looking Glass panel/);
  assert.match(faultOf({ error: 99 }), /error 99/);
});

const ATLAS = { us: [0, 1, 2, 3], vs: [0, 2, 4] };
const VIEWS = { atlas: ATLAS, centre: [2, 2], view_cols: 30, view_rows: 20, missing: [] };

test("tile i of a quilt is view i of the middle row, from the lower left to the right and then upward", () => {
  const quilt = quiltOf(VIEWS);
  assert.deepEqual([quilt.columns, quilt.rows, quilt.width, quilt.height, quilt.aspect], [2, 2, 60, 40, 1.5]);
  assert.deepEqual(
    quilt.tiles.map(({ to }) => [to.x, to.y]),
    [
      [0, 20],
      [30, 20],
      [0, 0],
      [30, 0],
    ],
  );
  assert.deepEqual(
    quilt.tiles.map(({ from }) => [from.x, from.y]),
    [
      [0, 20],
      [30, 20],
      [60, 20],
      [90, 20],
    ],
  );
});

test("a view that does not exist has no tile, and the columns are as those of the output", () => {
  const quilt = quiltOf({ ...VIEWS, missing: [[0, 2]] });
  assert.deepEqual([quilt.columns, quilt.rows, quilt.tiles[0].from.x], [3, 1, 30]);
  assert.deepEqual([8, 45, 48, 7].map(tileColumns), [4, 9, 8, 7]); // as Quilt.tile_columns
});

test("the quilt of a frame is found by its name", () => {
  const files = ["exports/quilt/0001_qs8x6a0.75.png", "exports/quilt/0010_qs8x6a0.75.png"];
  assert.equal(fileOfFrame(files, 10), files[1]);
  assert.equal(fileOfFrame(files, 2), null);
});
