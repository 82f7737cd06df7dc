// Two eyes among the views, an observer's numbers, and the depths of the slider.
import assert from "node:assert/strict";
import { test } from "node:test";
import { scaleOf } from "../../service/dashboard/static/viewer/depth/depth_scale.js";
import { ownShare, zoneOf } from "../../service/dashboard/static/viewer/observed.js";
import { eyeAt, eyePair, LEFT, RIGHT, viewsApart } from "../../service/dashboard/static/viewer/painting/stereo.js";
import { numbersAt, placeOf } from "../../service/dashboard/static/viewer/painting/views.js";

const EIGHT = {
  lattice: "square", lens_rows: 90, lens_cols: 90, us: 8, vs: 8, pitch_mm: 1, gap_mm: 3.3, viewing_distance_mm: 500,
  view_rows: 90, view_cols: 90,
  depths: { from_mm: -29.2, to_mm: 50.6, lenses_per_mm: [0.0379, 0.0379] },
}; // prettier-ignore

test("of 8 views that are 19 mm apart at 500 mm, two eyes are three to four apart", () => {
  assert.ok(Math.abs(viewsApart(EIGHT, 63) - 3.33) < 0.01);
  const [left, right] = eyePair(EIGHT, { x: 0, y: 0.5 }, 63);
  assert.ok(left.x < right.x && left.y === right.y);
  const apart = numbersAt(EIGHT, right)[0] - numbersAt(EIGHT, left)[0];
  assert.ok(Math.abs(apart - viewsApart(EIGHT, 63)) < 1e-9);
});

test("at the outermost view the pair keeps its distance, and a pair wider than all views takes the outermost ones", () => {
  const [left, right] = eyePair(EIGHT, { x: 1, y: 0 }, 63);
  assert.equal(right.x, 1);
  assert.ok(Math.abs(numbersAt(EIGHT, right)[0] - numbersAt(EIGHT, left)[0] - viewsApart(EIGHT, 63)) < 1e-9);
  assert.deepEqual(
    eyePair(EIGHT, { x: 0, y: 0 }, 1000).map(({ x }) => x),
    [-1, 1],
  );
});

test("the middle of the views is seen from the middle, and views on the right from the right", () => {
  assert.deepEqual(eyeAt(EIGHT, { x: 0, y: 0 }), { x: 0, y: 0, z: 500 });
  const { x, y } = eyeAt(EIGHT, placeOf(EIGHT, 4.5, 2.5));
  assert.ok(Math.abs(x - 18.94) < 0.01 && Math.abs(y - 18.94) < 0.01);
});

test("grey stays grey in the picture for red-cyan glasses", () => {
  for (let row = 0; row < 3; row++) {
    const sum = [0, 1, 2].reduce((total, col) => total + LEFT[3 * row + col] + RIGHT[3 * row + col], 0);
    assert.ok(Math.abs(sum - 1) < 0.002, `row ${row}: ${sum}`);
  }
});

test("within the viewing zone less the display, each lens shows its own cell, and beyond it fewer do", () => {
  assert.ok(Math.abs(zoneOf(EIGHT, 3.3, 500) - 151.5) < 0.1);
  assert.equal(ownShare(EIGHT, { x: 31, y: 0, z: 500 }, 3.3), 1);
  const aside = ownShare(EIGHT, { x: 75.7, y: 0, z: 500 }, 3.3);
  assert.ok(Math.abs(aside - 0.5) < 0.02, aside);
  assert.ok(ownShare(EIGHT, { x: 31, y: 0, z: 500 }, 3.3, 63) < 1, "one of two eyes is beyond");
});

test("on the hexagonal lattice the lenses that show their own cell are those of the library", () => {
  const array = { ...EIGHT, lattice: "hexagonal", lens_rows: 16, lens_cols: 20 };
  // By lippmann.lightfield.views.perspective.inside_cells.
  for (const [x, y, z, share] of [
    [0, 0, 500, 1],
    [60, 20, 500, 1],
    [75, 0, 500, 0.55],
    [0, 80, 500, 0.821875],
    [40, -60, 400, 0],
  ]) {
    assert.ok(Math.abs(ownShare(array, { x, y, z }, 3.3) - share) < 0.01, `${x}, ${y}: ${share}`);
  }
});

test("the slider has round steps over the useful range, and reaches what was clicked beyond it", () => {
  const { step_mm, least_mm, most_mm, rounded } = scaleOf(EIGHT);
  assert.deepEqual([step_mm, least_mm, most_mm], [0.5, -29, 50.5]);
  assert.equal(rounded(37.28), 37.5);
  assert.equal(scaleOf(EIGHT, 63.2).most_mm, 63);
  assert.equal(scaleOf(EIGHT, 10).most_mm, 50.5);
});

test("a depth at which views of neighbours no longer overlap is out of reach", () => {
  assert.ok(scaleOf(EIGHT, 1e6).most_mm <= 89 / 0.0379);
});
