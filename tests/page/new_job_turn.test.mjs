// The turn of the rig about the point that it looks at.
import assert from "node:assert/strict";
import { test } from "node:test";
import { angleOf, turned } from "../../service/dashboard/static/new-job/turn.js";

const STAGE = { location: [0, 60, -1000], look_at: [0, 60, 0], up: [0, 1, 0] };

test("a quarter turn about the vertical ends beside the scene, as far away as before", () => {
  assert.deepEqual(turned(STAGE, 90), [-1000, 60, 0]);
  assert.deepEqual(turned(STAGE, 0), STAGE.location);
});

test("the angle of a turned location is the angle of the turn", () => {
  for (const deg of [-45, -1, 0, 7, 44]) {
    assert.equal(angleOf(STAGE, turned(STAGE, deg)), deg);
    const slanted = { location: [300, 200, -500], look_at: [10, 20, 30], up: [0.2, 1, 0.1] };
    assert.equal(angleOf(slanted, turned(slanted, deg)), deg);
  }
});
