import assert from "node:assert/strict";
import { test } from "node:test";
import { ahead, ticked } from "../../service/dashboard/static/viewer/time/clock.js";
import { Shelf } from "../../service/dashboard/static/viewer/painting/shelf.js";
import { fromQuery, START, toPatch } from "../../service/dashboard/static/viewer/stand.js";
import { bounded, FIT, panned, partAt, rectOf, zoomedAt } from "../../service/dashboard/static/viewer/hand/zoom.js";

const queryOf = (stand) => {
  const given = Object.entries(toPatch(stand)).filter(([, value]) => value !== undefined);
  return new URLSearchParams(Object.fromEntries(given));
};

test("a state and its address are two ways to say the same, and the start needs no words", () => {
  assert.equal(queryOf(START).toString(), "");
  assert.deepEqual(fromQuery(new URLSearchParams()), START);
  const stand = {
    ...START,
    frame: 3,
    mode: "focus",
    place: { x: 0.2, y: 0 },
    isSmooth: false,
    depth_mm: -7.25,
    eye: { x: 10, y: 0, z: 400 },
    eyes: "anaglyph",
    zoom: { scale: 2, x: 0.25, y: 0.5 },
  };
  assert.deepEqual(fromQuery(queryOf(stand)), stand);
});

test("wrong values of an address are those of the start", () => {
  const wrong = "frame=0&look=nothing&x=2&y=one&depth=&zoom=0.1&zx=NaN&eyes=three&sheet=__proto__";
  assert.deepEqual(fromQuery(new URLSearchParams(wrong)), START);
});

const PICTURE = { width: 100, height: 50 };
const STAGE = { width: 400, height: 400 };

test("a picture fits into the stage, and a zoom keeps the point under the pointer", () => {
  assert.deepEqual(rectOf(FIT, PICTURE, STAGE), { left: 0, top: 100, width: 400, height: 200 });
  const point = { x: 100, y: 150 };
  const before = partAt(FIT, point, PICTURE, STAGE);
  const zoom = zoomedAt(FIT, 4, point, PICTURE, STAGE);
  assert.deepEqual(partAt(zoom, point, PICTURE, STAGE), before);
  const back = zoomedAt(zoom, 1 / 4, point, PICTURE, STAGE);
  assert.deepEqual(back, FIT);
});

test("an enlarged picture moves with the hand and leaves no gap", () => {
  const zoom = { scale: 4, x: 0.5, y: 0.5 };
  const left = rectOf(zoom, PICTURE, STAGE).left;
  assert.equal(rectOf(panned(zoom, 30, 0, PICTURE, STAGE), PICTURE, STAGE).left, left + 30);
  assert.equal(rectOf(panned(zoom, 1e6, 0, PICTURE, STAGE), PICTURE, STAGE).left, 0);
  assert.deepEqual(bounded({ scale: 0.5, x: 9, y: 9 }, PICTURE, STAGE), FIT);
});

test("the clock waits for a frame that is not loaded, skips none, and loops", () => {
  const clock = { index: 0, count: 3, speed_fps: 10, isLooping: true, since_ms: 0 };
  const isReady = () => true;
  assert.equal(ticked(clock, 99, isReady).index, 0);
  assert.deepEqual([ticked(clock, 130, isReady).index, ticked(clock, 130, isReady).since_ms], [1, 100]);
  assert.equal(ticked(clock, 5000, () => false).index, 0);
  assert.deepEqual([ticked(clock, 5000, isReady).index, ticked(clock, 5000, isReady).since_ms], [1, 5000]);
  assert.equal(ticked({ ...clock, index: 2 }, 100, isReady).index, 0);
  assert.equal(ticked({ ...clock, index: 2, isLooping: false }, 100, isReady).isOver, true);
  assert.deepEqual(ahead({ ...clock, index: 1 }, 4), [2, 0]);
  assert.deepEqual(ahead({ ...clock, index: 1, isLooping: false }, 4), [2]);
});

test("a shelf loads a thing once, and throws away the oldest but not what is shown", async () => {
  const closed = [];
  const loads = [];
  const shelf = new Shelf({
    load: async (key) => (loads.push(key), { key }),
    bytesOf: () => 10,
    close: ({ key }) => closed.push(key),
    limit_bytes: 20,
  });
  await Promise.all([shelf.get("a"), shelf.get("a")]);
  shelf.use("a");
  for (const key of ["b", "c", "d"]) await shelf.get(key);
  assert.deepEqual(
    [loads, closed],
    [
      ["a", "b", "c", "d"],
      ["b", "c"],
    ],
  );
  assert.equal(shelf.peek("b"), null);
  shelf.clear();
  assert.deepEqual([closed, shelf.bytes], [["b", "c", "a", "d"], 0]);
});

test("what failed is loaded again, and what was thrown away before it came is closed", async () => {
  let isBroken = true;
  const closed = [];
  const shelf = new Shelf({
    load: async (key) => {
      if (isBroken) throw new Error("no answer");
      return key;
    },
    bytesOf: () => 1,
    close: (key) => closed.push(key),
    limit_bytes: 9,
  });
  await assert.rejects(shelf.get("a"), /no answer/);
  isBroken = false;
  const promise = shelf.get("a");
  shelf.drop("a");
  await assert.rejects(promise, /no longer wanted/);
  assert.deepEqual(closed, ["a"]);
});
