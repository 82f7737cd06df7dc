// All frames of a job in the viewer: which are done, what is around one of them, and the film strip.
import assert from "node:assert/strict";
import { test } from "node:test";
import { itemOf, numberOf, numbersOf, placesAround } from "../../service/dashboard/static/viewer/time/frame_items.js";
import { placeByKey, scrolledTo } from "../../service/dashboard/static/viewer/time/strip.js";

const DONE = 2;
const grid = { numbers: Int32Array.from([1, 2, 9]), statuses: Uint8Array.from([DONE, 0, DONE]) };

test("the pictures of a frame have the names of their files", () => {
  const item = itemOf(7, (name) => `/of/${name}`);
  assert.deepEqual([item.frame, item.thumb, item.views], [7, "/of/thumbs/0007.webp", "/of/views/0007.exr"]);
  assert.equal(itemOf(12345, String).integral, "integral/12345.exr");
});

test("the frames that are done are those of all statuses, of the loaded pages, or of both", () => {
  assert.deepEqual(numbersOf([], grid, DONE), [1, 9]);
  assert.deepEqual(numbersOf([6], null, DONE), [6]);
  // Statuses that were asked for before the frame was done.
  assert.deepEqual(numbersOf([2], { ...grid, statuses: new Uint8Array(3) }, DONE), [2]);
});

test("a frame that is not done lies between its neighbours that are", () => {
  const order = [1, 2, 9, 10];
  assert.deepEqual(placesAround([1, 9, 10], 9, order), { at: 1, before: 0, after: 2 });
  assert.deepEqual(placesAround([1, 9, 10], 2, order), { at: -1, before: 0, after: 1 });
  assert.deepEqual(placesAround([2, 9], 1, order), { at: -1, before: -1, after: 0 });
  assert.deepEqual(placesAround([2, 9], 10, order), { at: -1, before: 1, after: 2 });
  // Frames may be rendered in another order than that of their numbers.
  assert.deepEqual(placesAround([10, 2], 9, [10, 9, 2, 1]), { at: -1, before: 0, after: 1 });
  assert.deepEqual(placesAround([2, 9], 77, order), { at: -1, before: -1, after: 0 });
});

test("a strip moves as little as it can to show a frame with its neighbours", () => {
  assert.equal(scrolledTo(5, 100, 600, 50), 100);
  assert.equal(scrolledTo(1, 100, 600, 50), 0);
  assert.equal(scrolledTo(100, 100, 600, 50), 102 * 50 - 600);
  assert.equal(scrolledTo(0, 100, 600, 50), 0);
  assert.equal(scrolledTo(10, 0, 100, 50), 10.5 * 50 - 50); // no room for three
});

test("the keys of a strip lead from a frame that is done to the next one, and no further than the last", () => {
  const places = { before: 3, after: 5 };
  assert.deepEqual(
    ["ArrowLeft", "ArrowRight", "Home", "End", "a"].map((key) => placeByKey(key, places, 9)),
    [3, 5, 0, 8, null],
  );
  assert.equal(placeByKey("ArrowRight", { before: 7, after: 9 }, 9), 8);
  assert.equal(placeByKey("ArrowLeft", { before: -1, after: 1 }, 9), 0);
});

test("the path of a thumbnail tells its frame", () => {
  assert.equal(numberOf("/api/v1/jobs/0a/artifacts/thumbs/0042.webp"), 42);
  assert.equal(numberOf("/api/v1/jobs/0a/artifacts/thumbs/12345.webp"), 12345);
  assert.equal(numberOf(null), null);
});
