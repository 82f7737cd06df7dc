// The grid of frames, and the statuses that it shows.
import assert from "node:assert/strict";
import { test } from "node:test";
import { countsOf, expand, placeOfFrame, textOf } from "../../service/dashboard/static/jobs/frames/frame_runs.js";
import { gridOf, placeOf, squareAt, squareByKey } from "../../service/dashboard/static/jobs/frames/grid_layout.js";

test("a place and a square are inverses, for few frames and for many, on any width", () => {
  for (const total of [1, 6, 500, 10_000, 200_000])
    for (const width of [0, 300, 900]) {
      const grid = gridOf(total, width);
      for (const square of [0, 1, Math.floor(total / 2), total - 1]) {
        if (square >= total) continue;
        const [x, y] = placeOf(grid, square);
        assert.equal(squareAt(grid, x + 1, y + 1), square);
        assert.ok(y < grid.height_px);
      }
    }
});

test("few frames are large, 10,000 fit on a screen or two, and there is nothing beside the grid", () => {
  assert.equal(gridOf(6, 900).step_px, 22);
  assert.ok(gridOf(10_000, 900).height_px <= 1600);
  const grid = gridOf(6, 100);
  assert.equal(squareAt(grid, 99, 5), -1);
  assert.equal(squareAt(grid, -1, 5), -1);
  assert.equal(squareAt(grid, 5, 500), -1);
});

test("keys lead from square to square and never out of the grid", () => {
  const grid = gridOf(100, 220); // ten columns
  assert.equal(squareByKey(grid, 15, "ArrowDown"), 25);
  assert.equal(squareByKey(grid, 95, "ArrowDown"), 95);
  assert.equal(squareByKey(grid, 0, "ArrowLeft"), 0);
  assert.equal(squareByKey(grid, 7, "End"), 99);
  assert.equal(squareByKey(grid, 7, "a"), null);
});

const RUNS = [
  { status: "done", first: 1, last: 5, step: 2 },
  { status: "failed", first: 6, last: 8, step: 1 },
  { status: "failed", first: 20, last: 20, step: 1 },
];

test("runs become frames", () => {
  const { numbers, statuses } = expand(RUNS);
  assert.deepEqual([...numbers], [1, 3, 5, 6, 7, 8, 20]);
  assert.deepEqual(countsOf(statuses), [0, 0, 3, 4, 0]);
  assert.equal(placeOfFrame(numbers, 20), 6);
  assert.equal(placeOfFrame(numbers, 2), -1);
});

test("the frames of a status are a short text", () => {
  assert.equal(textOf(expand(RUNS), "failed", 5), "6-8, 20");
  assert.equal(textOf(expand(RUNS), "failed", 1), "6-8 …");
  assert.equal(textOf(expand(RUNS), "waiting", 5), "");
});
