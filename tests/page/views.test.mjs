// The views at a position of the eye.
import assert from "node:assert/strict";
import { test } from "node:test";
import { nearestView, nextPlace, numbersAt, placeOf } from "../../service/dashboard/static/viewer/painting/views.js";

const EIGHT = { us: 8, vs: 8, centre: [4, 4], missing: [] };

test("a place and the numbers of its view are two ways to say the same", () => {
  for (const [u, v] of [
    [0, 0],
    [7, 7],
    [3.25, 6.5],
  ]) {
    const [across, down] = numbersAt(EIGHT, placeOf(EIGHT, u, v));
    assert.ok(Math.abs(across - u) < 1e-12 && Math.abs(down - v) < 1e-12);
  }
});

test("with a single view every place is that view", () => {
  assert.deepEqual(placeOf({ us: 1, vs: 1 }, 0, 0), { x: 0, y: 0 });
});

test("a step goes to the next whole view, and not beyond the outermost", () => {
  const between = placeOf(EIGHT, 3.4, 4);
  assert.deepEqual(numbersAt(EIGHT, nextPlace(EIGHT, between, [1, 0])), [4, 4]);
  assert.deepEqual(numbersAt(EIGHT, nextPlace(EIGHT, between, [-1, 0])), [3, 4]);
  assert.deepEqual(numbersAt(EIGHT, nextPlace(EIGHT, placeOf(EIGHT, 7, 4), [1, 0])), [7, 4]);
});

test("a missing view is never the nearest one", () => {
  assert.deepEqual(nearestView({ ...EIGHT, missing: [[0, 0]] }, { x: -1, y: -1 }), [1, 0]);
});
