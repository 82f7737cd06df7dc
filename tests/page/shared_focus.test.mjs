// The control that takes the focus after another one has gone.
import assert from "node:assert/strict";
import { test } from "node:test";
import { placeAfter } from "../../service/dashboard/static/shared/focus_place.js";

test("the next control that is ready takes the focus, or else the one before", () => {
  assert.equal(placeAfter([true, true, true], 1), 1); // What took the place of the one that has gone.
  assert.equal(placeAfter([true, false, true], 1), 2);
  assert.equal(placeAfter([true, true, false], 2), 1);
  assert.equal(placeAfter([true, true], 7), 1);
  assert.equal(placeAfter([true], -1), 0);
  assert.equal(placeAfter([false], 0), -1);
  assert.equal(placeAfter([], 0), -1);
});
