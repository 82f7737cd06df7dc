// The timeline of attempts.
import assert from "node:assert/strict";
import { test } from "node:test";
import { layOut, outcomesOf, ticksOf } from "../../service/dashboard/static/jobs/work/timeline_layout.js";

const at = (second) => new Date(1_000_000 + second * 1000).toISOString();
const attempt = (worker, start, end, outcome = "done") => ({
  worker,
  outcome,
  started_at: at(start),
  ended_at: end === null ? null : at(end),
});

test("attempts that overlap are in different slots of their worker", () => {
  const { workers, start_s, end_s } = layOut(
    [attempt("b", 0, 10), attempt("a", 5, 15), attempt("b", 4, 6), attempt("b", 6, 20)],
    2000,
  );
  assert.deepEqual(
    workers.map(({ name, slots }) => [name, slots.map((slot) => slot.length)]),
    [
      ["a", [1]],
      ["b", [1, 2]],
    ],
  );
  assert.deepEqual([start_s, end_s], [1000, 1020]);
});

test("an attempt without an end ends now if it runs, and has no length if it was lost", () => {
  const { workers } = layOut([attempt("a", 0, null, "running"), attempt(null, 0, null, "lost")], 1030);
  const lengths = workers.map(({ name, slots }) => [name, slots[0][0].end_s - slots[0][0].start_s]);
  assert.deepEqual(lengths, [
    ["a", 30],
    ["unknown", 0],
  ]);
});

test("no attempts, and clocks that differ", () => {
  assert.deepEqual(layOut([], 7), { workers: [], start_s: 7, end_s: 7 });
  const { workers } = layOut([attempt("a", 10, null, "running")], 1000);
  assert.equal(workers[0].slots[0][0].end_s, 1010);
});

test("the legend counts what became of attempts", () => {
  const attempts = [attempt("a", 0, 5, "lost"), attempt("a", 5, 9, "done"), attempt("b", 5, 9, "lost")];
  assert.deepEqual(outcomesOf(attempts), [
    ["done", 1],
    ["lost", 2],
  ]);
});

test("an axis has round times, and few of them", () => {
  assert.deepEqual(ticksOf(100, 6), [0, 30, 60, 90]);
  for (const length of [0.5, 59, 3700, 1e6, 1e8]) assert.ok(ticksOf(length, 6).length <= 7);
});
