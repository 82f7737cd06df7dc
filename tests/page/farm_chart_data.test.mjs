// The numbers of the charts of the farm.
import assert from "node:assert/strict";
import { test } from "node:test";
import { columns, top, totals } from "../../service/dashboard/static/farm/chart_data.js";

const HISTORY = { begins_at: "1970-01-01T01:00:00Z", step_s: 720, frames: [0, 3, 6], slots: [0.5, 1, 3] };

test("frames of a step become frames an hour at the end of the step", () => {
  assert.deepEqual(columns(HISTORY), { times: [4320, 5040, 5760], rates: [0, 15, 30], slots: [0.5, 1, 3] });
});

test("the totals are the frames of all steps and the mean of the slots", () => {
  assert.deepEqual(totals(HISTORY), { frames: 9, slots: 1.5 });
  assert.deepEqual(totals({ ...HISTORY, frames: [], slots: [] }), { frames: 0, slots: 0 });
});

test("the top of an axis is round and never below a value", () => {
  assert.deepEqual([[], [0.2], [3], [7], [10], [10.5], [480]].map(top), [1, 1, 5, 10, 10, 20, 500]);
});
