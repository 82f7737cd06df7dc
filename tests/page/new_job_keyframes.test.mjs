// Keyframes of a number: the curve is that of the library, and a change keeps the frames rising.
import assert from "node:assert/strict";
import { test } from "node:test";
import {
  animationOf,
  curveOf,
  freeFrame,
  isAnimated,
  mayChange,
  moved,
  rounded,
  shownFrames,
  shownValues,
  spanOfFrames,
  valueAtFrame,
  withFrame,
  withKey,
  withoutKey,
} from "../../service/dashboard/static/new-job/animation/keyframes.js";

const RULE = { parts: ["rig", "stage", "parameters"], constant: ["rig.px_per_lens", "rig.device"] };
const KEYS = [
  [1, 0],
  [3, 10],
  [7, 16],
  [9, 40],
];
const SPAN = [1, 9];
const framesOf = ({ keyframes }) => keyframes.map(([frame]) => frame);

test("a linear curve goes straight from keyframe to keyframe, and is constant outside", () => {
  const values = [0, 1, 2, 5, 9, 12].map((frame) => valueAtFrame({ keyframes: KEYS }, frame));
  assert.deepEqual(values, [0, 0, 5, 13, 40, 40]);
  assert.ok(Number.isNaN(valueAtFrame({ keyframes: [] }, 1)));
});

test("a smooth curve has the values that the library computes", () => {
  // From Keyframes(keyframes=..., interpolation="smooth").at(frame) of lippmann.job.animation.keyframes.
  const smooth = { keyframes: KEYS, interpolation: "smooth" };
  const expected = [0, 4.386363636363637, 10, 11.770884520884522, 12.767813267813267, 13.880835380835382, 16];
  expected.forEach((value, place) => assert.ok(Math.abs(valueAtFrame(smooth, place + 1) - value) < 1e-12));
  const [low, high] = [39, 61];
  const turning = { ...smooth, keyframes: [[1, 60], [3, 40], [7, 45]] }; // prettier-ignore
  for (const [, y] of curveOf(turning, [1, 7], [low, high])) assert.ok(y >= 1 / 22 - 1e-9 && y <= 21 / 22 + 1e-9);
});

test("the frames of a job are those of all parts of their text", () => {
  const spans = ["1-48:2, 60", "7", " 3 - 5 ", undefined].map(spanOfFrames);
  assert.deepEqual(spans, [[1, 60], [7, 7], [3, 5], [1, 1]]); // prettier-ignore
  assert.deepEqual(["", "a-3", "0", "1.5"].map(spanOfFrames), [null, null, null, null]);
});

test("numbers of the rig, the stage and the parameters may change, but for those that size a frame", () => {
  const paths = [
    "rig.lens_array.offset_mm",
    "stage.location.0",
    "parameters.turn",
    "rig.px_per_lens",
    "rig.device.dpi",
  ];
  assert.deepEqual(
    paths.map((path) => mayChange(RULE, path)),
    [true, true, true, false, false],
  );
  assert.ok(!mayChange(RULE, "fps") && !mayChange(RULE, "outputs.0.focus_mm"));
});

test("a keyframe that is moved stays between its neighbours and on whole frames", () => {
  const animation = { keyframes: KEYS, interpolation: "smooth" };
  assert.deepEqual(moved(animation, 1, [5.4, 3], SPAN).keyframes[1], [5, 3]);
  assert.deepEqual(framesOf(moved(animation, 1, [99, 3], SPAN)), [1, 6, 7, 9]);
  assert.deepEqual(framesOf(moved(animation, 1, [0, 3], SPAN)), [1, 2, 7, 9]);
  assert.deepEqual(framesOf(moved(animation, 0, [-5, 3], SPAN)), [1, 3, 7, 9]);
  assert.deepEqual(framesOf(moved(animation, 3, [12, 3], SPAN)), [1, 3, 7, 9]);
  assert.equal(moved(animation, 1, [5, 3], SPAN).interpolation, "smooth");
  assert.deepEqual(animation.keyframes, KEYS);
});

test("a constant becomes an animation, keyframes are added where there is room, and removed", () => {
  const begun = animationOf(40, SPAN);
  assert.deepEqual(begun.keyframes, [[1, 40], [9, 40]]); // prettier-ignore
  assert.ok(isAnimated(begun) && !isAnimated(40) && !isAnimated(null) && !isAnimated([]));
  assert.equal(freeFrame(begun, SPAN), 5);
  assert.deepEqual(framesOf(withFrame(begun, 5, 1)), [1, 5, 9]);
  assert.deepEqual(withFrame(begun, 9, 1).keyframes, [[1, 40], [9, 1]]); // prettier-ignore
  assert.deepEqual(withoutKey(begun, 0).keyframes, [[9, 40]]);
  assert.equal(freeFrame(animationOf(40, [1, 2]), [1, 2]), null);
  assert.equal(freeFrame({ keyframes: [[2, 1]] }, [1, 9]), 6);
});

test("what somebody is still writing is kept and is not in the plot", () => {
  const writing = withKey({ keyframes: KEYS }, 1, ["", "far"]);
  assert.deepEqual(writing.keyframes[1], ["", "far"]);
  assert.deepEqual(shownFrames(writing, [2, 20]), [1, 20]);
  assert.equal(valueAtFrame(writing, 4), 8);
});

test("the plot has the range of the slider, or some room around the values, and short numbers", () => {
  const few = animationOf(40, SPAN);
  assert.deepEqual(shownValues(few, { least: -80, most: 80 }), [-80, 80]);
  assert.deepEqual(shownValues(few), [30, 50]);
  assert.deepEqual(shownValues({ keyframes: [] }), [-1, 1]);
  assert.equal(rounded(39.98765, [-80, 80]), 40);
  assert.equal(rounded(0.123456, [0, 1]), 0.123);
});
