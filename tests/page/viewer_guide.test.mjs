// Mixing views along their depths: the depths of a view and of an eye between views.
import assert from "node:assert/strict";
import { test } from "node:test";
import { Guide, isGuided, UNKNOWN_MM } from "../../service/dashboard/static/viewer/depth/guide.js";
import { blend, placeOf, substitutes } from "../../service/dashboard/static/viewer/painting/views.js";

const VIEWS = {
  us: 8, vs: 8, centre: [4, 4], missing: [], view_rows: 1, view_cols: 10,
  atlas: { us: [0, 2, 5, 7], vs: [0, 2, 5, 7] },
  depths: { lenses_per_mm: [0.1, 0.1] },
  depth_map: { source: "estimate" },
}; // prettier-ignore
// A bar of two pixels that moves by two pixels from view to view, before a wall on the display and an unknown sky.
const MAP = { rows: 1, cols: 10, depths_mm: Float32Array.from([0, 0, 0, 0, 20, 20, 0, 0, 0, NaN]) };

test("a near bar stands against the eye, between views too, and the unknown is behind everything", () => {
  const guide = new Guide(VIEWS, MAP);
  const barAt = (depths) => [...depths].flatMap((depth_mm, col) => (depth_mm === 20 ? [col] : []));
  assert.deepEqual(barAt(guide.depths([4, 4])), [4, 5]);
  assert.deepEqual(barAt(guide.depths([5, 4])), [2, 3]);
  assert.deepEqual(barAt(guide.depths([4.5, 4])), [3, 4]);
  assert.deepEqual(barAt(guide.depths([4.25, 4])), [3, 4, 5], "half of two pixels");
  assert.equal(guide.depths([4, 4])[9], UNKNOWN_MM);
});

test("the depths of the last views are kept, and those of the oldest are not", () => {
  const guide = new Guide(VIEWS, MAP);
  const first = guide.depthsOfView([0, 0]);
  assert.equal(guide.depthsOfView([0, 0]), first);
  for (let u = 1; u < 40; u++) guide.depthsOfView([u, 0]);
  assert.notEqual(guide.depthsOfView([0, 0]), first);
});

test("a depth that takes long to estimate is not asked for, and a true one is", () => {
  assert.ok(isGuided(VIEWS));
  const large = { ...VIEWS, view_rows: 512, view_cols: 512 };
  assert.ok(!isGuided(large));
  assert.ok(isGuided({ ...large, depth_map: { source: "truth" } }));
});

test("each of four mixed cells tells which view it has, and one that is missing has that of its neighbour", () => {
  const views = { ...VIEWS, missing: [[7, 0]] };
  const cells = blend(views, substitutes(views), placeOf(views, 6, 1));
  assert.deepEqual(
    cells.map(({ number }) => number),
    [[5, 0], [5, 0], [5, 2], [7, 2]],
  ); // prettier-ignore
  assert.ok(Math.abs(cells.reduce((sum, { share }) => sum + share, 0) - 1) < 1e-12);
});
