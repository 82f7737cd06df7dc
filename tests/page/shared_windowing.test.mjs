// The rows of a long list that are drawn.
import assert from "node:assert/strict";
import { test } from "node:test";
import { between, pagesOf, visibleRows } from "../../service/dashboard/static/shared/windowing.js";

test("only rows that can be seen, and a few around them, are drawn", () => {
  assert.deepEqual(visibleRows(0, 800, 80, 10_000), [0, 16]);
  assert.deepEqual(visibleRows(80 * 5000, 800, 80, 10_000), [4994, 5016]);
  assert.deepEqual(visibleRows(80 * 9990, 800, 80, 10_000), [9984, 10_000]);
});

test("a list that begins below the edge, is short, is empty or has been scrolled past", () => {
  assert.deepEqual(visibleRows(-300, 800, 80, 10_000), [0, 13]);
  assert.deepEqual(visibleRows(0, 800, 80, 3), [0, 3]);
  assert.deepEqual(visibleRows(0, 800, 80, 0), [0, 0]);
  assert.deepEqual(visibleRows(80 * 5000, 800, 80, 3), [3, 3]);
});

test("the pages of rows", () => {
  assert.deepEqual(pagesOf(0, 1, 50), [0]);
  assert.deepEqual(pagesOf(49, 101, 50), [0, 1, 2]);
  assert.deepEqual(pagesOf(50, 100, 50), [1]);
  assert.deepEqual(pagesOf(3, 3, 50), [0]);
});

test("a selection goes from row to row in either direction, over those that are loaded", () => {
  const ids = { 1: "a", 2: "b", 4: "d" };
  assert.deepEqual(between(ids, 4, 1), ["a", "b", "d"]);
  assert.deepEqual(between(ids, 1, 1), ["a"]);
});
