// The depth map of a view: its file, its colours and its legend, and how it follows the eye.
import assert from "node:assert/strict";
import { test } from "node:test";
import {
  colourOf,
  deepestShown,
  depthAt,
  gradientOf,
  overlayPixels,
  parsePfm,
  seenFrom,
} from "../../service/dashboard/static/viewer/depth/depth_map.js";

// A PFM as the service writes it: little-endian, the lowest row first.
function pfm(rows, { scale = "-1", isLittle = true } = {}) {
  const head = new TextEncoder().encode(`Pf\n${rows[0].length} ${rows.length}\n${scale}\n`);
  const buffer = new ArrayBuffer(head.length + 4 * rows.length * rows[0].length);
  new Uint8Array(buffer).set(head);
  const view = new DataView(buffer, head.length);
  rows
    .toReversed()
    .flat()
    .forEach((value, index) => view.setFloat32(4 * index, value, isLittle));
  return buffer;
}
const ROWS = [
  [1, 2, 3],
  [-4, NaN, 6],
];

test("a PFM of either order of bytes is read from its lowest row up", () => {
  for (const how of [{}, { scale: "1", isLittle: false }]) {
    const { rows, cols, depths_mm } = parsePfm(pfm(ROWS, how));
    assert.deepEqual([rows, cols], [2, 3]);
    assert.deepEqual([...depths_mm], ROWS.flat());
  }
});

test("what is cut short or is no PFM is refused", () => {
  const whole = pfm(ROWS);
  assert.throws(() => parsePfm(whole.slice(0, whole.byteLength - 1)), /Expected a PFM/);
  assert.throws(() => parsePfm(new TextEncoder().encode("PF\n3 2\n-1\n").buffer), /Expected a PFM/);
  assert.throws(() => parsePfm(new ArrayBuffer(0)), /Expected a PFM/);
});

test("the depth at a part of the picture is that of its pixel, the border included", () => {
  const map = parsePfm(pfm(ROWS));
  assert.equal(depthAt(map, 0, 0), 1);
  assert.equal(depthAt(map, 0.99, 0.99), 6);
  assert.equal(depthAt(map, 1, 1), 6);
});

test("the display is grey, what is in front of it is red, and what is behind it is blue", () => {
  const [red, green, blue] = colourOf(0, 40);
  assert.ok(red === green && green === blue);
  const near = colourOf(40, 40);
  const far = colourOf(-40, 40);
  assert.ok(near[0] > 2 * near[2] && far[2] > 2 * far[0]);
  assert.deepEqual(colourOf(400, 40), near, "beyond the end of the legend");
  assert.match(gradientOf(40), /^linear-gradient\(to right, rgb\(.*\) 0.0%, .* 100.0%\)$/);
});

test("the legend ends at a round depth that holds nearly all", () => {
  assert.equal(deepestShown({ depths_mm: Float32Array.from([-37.3, 12, NaN]) }), 40);
  assert.equal(deepestShown({ depths_mm: Float32Array.from([0.3]) }), 0.3);
  assert.equal(deepestShown({ depths_mm: Float32Array.from([NaN]) }) > 0, true);
  const crowd = Float32Array.from({ length: 1000 }, (_, index) => (index < 5 ? 900 : 18));
  assert.equal(deepestShown({ depths_mm: crowd }), 20);
});

test("where the depth is unknown the overlay is transparent", () => {
  const pixels = overlayPixels(Float32Array.from([10, NaN]), 40);
  assert.equal(pixels[3], 255);
  assert.deepEqual([...pixels.slice(4)], [0, 0, 0, 0]);
});

test("a thing in front of the display moves against the eye, and one on it stands still", () => {
  const row = [0, 0, 0, 20, 20, 0, 0, 0, 0, 0];
  const map = { rows: 1, cols: row.length, depths_mm: Float32Array.from(row) };
  const moved = seenFrom(map, [2, 0], [0.05, 0]); // 20 mm x 0.05 lenses per mm x 2 views = 2 lenses to the left
  assert.deepEqual([...moved].slice(1, 3), [20, 20]);
  assert.equal(moved[8], 0);
  assert.equal(seenFrom(map, [0, 0], [0.05, 0]), map.depths_mm);
});
