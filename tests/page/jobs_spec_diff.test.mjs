// What differs between two jobs.
import assert from "node:assert/strict";
import { test } from "node:test";
import { commonFrames, differences, viewAt } from "../../service/dashboard/static/jobs/compare/spec_diff.js";

test("job files differ by the paths of their values", () => {
  const one = { scene: "fish", rig: { pitch_mm: 1, lens: null }, outputs: [1, 2], parameters: {} };
  const other = { scene: "fish", rig: { pitch_mm: 1.5, lens: null }, outputs: [1], parameters: { age: 3 } };
  assert.deepEqual(differences(one, other), [
    { path: "rig.pitch_mm", values: ["1", "1.5"] },
    { path: "outputs", values: ["[1,2]", "[1]"] },
    { path: "parameters", values: ["{}", "–"] },
    { path: "parameters.age", values: ["–", "3"] },
  ]);
  assert.deepEqual(differences(one, one), []);
});

test("frames that both have done", () => {
  const one = [
    { status: "done", first: 1, last: 9, step: 2 },
    { status: "waiting", first: 10, last: 12, step: 1 },
  ];
  const other = [{ status: "done", first: 1, last: 12, step: 1 }];
  assert.deepEqual(commonFrames(one, other), [1, 3, 5, 7, 9]);
  assert.deepEqual(commonFrames(other, []), []);
});

test("a place of the eye is a view, the same part of any grid of views", () => {
  const square = { us: 8, vs: 5, missing: [], centre: [4, 2] };
  assert.deepEqual(viewAt(square, { x: -1, y: -1 }), [0, 0]);
  assert.deepEqual(viewAt(square, { x: 1, y: 7 }), [7, 4]);
  assert.deepEqual(viewAt({ ...square, missing: [[0, 0]] }, { x: -1, y: -1 }), [4, 2]);
});
