// Keyframes: a number that changes with the frame, as lippmann/job/animation/keyframes.py describes it. Pure: no DOM.
//
// An animation is {keyframes: [[frame, value]], interpolation?}; it is constant before the first keyframe and after the
// last one. The frames rise.

const STEPS = 200; // The steps of a value over the range of the plot.

export const isAnimated = (value) => typeof value === "object" && value !== null && Array.isArray(value.keyframes);

// Whether the number at a path may have keyframes, by the rule that the schema of a job file has.
export const mayChange = (rule, path) =>
  rule.parts.includes(path.split(".")[0]) &&
  !rule.constant.some((field) => path === field || path.startsWith(`${field}.`));

// The first and the last frame of a text such as "1-48:2, 60"; null if it is none.
/** @returns {[number, number] | null} */
export function spanOfFrames(text) {
  const numbers = String(text ?? "1")
    .split(",")
    .flatMap((part) => part.split(":")[0].split("-").map(Number));
  return numbers.every((one) => Number.isInteger(one) && one > 0) ? [Math.min(...numbers), Math.max(...numbers)] : null;
}

// A constant as an animation over the frames of the job, to begin with.
export const animationOf = (value, [first, last]) => ({
  keyframes: [
    [first, value],
    [last, value],
  ],
});

// The keyframes that are numbers; somebody may still be writing the others.
const known = ({ keyframes }) => keyframes.filter((key) => key?.length === 2 && key.every(Number.isFinite));

// The frames that the plot shows: those of the job, and all keyframes.
/** @returns {[number, number]} */
export function shownFrames(animation, span) {
  const frames = [...span, ...known(animation).map(([frame]) => frame)];
  return [Math.min(...frames), Math.max(...frames)];
}

// The values that the plot shows: the range of a slider if there is one, and all keyframes with some room.
/** @param {any} animation @param {{ least: number, most: number }} [slider] @returns {[number, number]} */
export function shownValues(animation, slider) {
  const values = known(animation).map(([, value]) => value);
  if (slider) values.push(slider.least, slider.most);
  if (!values.length) return [-1, 1];
  const [low, high] = [Math.min(...values), Math.max(...values)];
  const room = slider ? 0 : (high - low || Math.abs(high) || 1) / 4;
  return [low - room, high + room];
}

// A round step, so that a value that is moved is a short number.
/** @param {[number, number]} range */
export const stepOf = ([low, high]) => 10 ** Math.floor(Math.log10((high - low || 1) / STEPS));

/** @param {number} value @param {[number, number]} range */
export function rounded(value, range) {
  const step = stepOf(range);
  return Number((Math.round(value / step) * step).toFixed(Math.max(0, -Math.floor(Math.log10(step)))));
}

const between = (low, value, high) => Math.min(high, Math.max(low, value));

// The animation after a keyframe was moved; it stays between its neighbours.
export function moved(animation, place, [frame, value], [first, last]) {
  const { keyframes } = animation;
  const least = place > 0 ? keyframes[place - 1][0] + 1 : Math.min(first, keyframes[place][0]);
  const most = place < keyframes.length - 1 ? keyframes[place + 1][0] - 1 : Math.max(last, keyframes[place][0]);
  return withKey(animation, place, [between(least, Math.round(frame), Math.max(least, most)), value]);
}

// The animation with another keyframe at a place, as somebody wrote it.
export const withKey = (animation, place, key) => ({
  ...animation,
  keyframes: animation.keyframes.map((one, other) => (other === place ? key : one)),
});

// The animation with one more keyframe; a keyframe at the same frame is replaced.
/** @param {any} animation @param {number} frame @param {number} value */
export function withFrame(animation, frame, value) {
  const others = animation.keyframes.filter(([other]) => other !== frame);
  return { ...animation, keyframes: [...others, [frame, value]].sort(([a], [b]) => a - b) };
}

export const withoutKey = (animation, place) => ({
  ...animation,
  keyframes: animation.keyframes.filter((_, other) => other !== place),
});

// A frame for one more keyframe: the middle of the widest gap, or after the last one; null if there is no room.
export function freeFrame(animation, span) {
  const frames = known(animation).map(([frame]) => frame);
  const [first, last] = span;
  const ends = [first - 1, ...frames, last + 1].sort((a, b) => a - b);
  const gaps = ends.slice(1).map((end, place) => [end - ends[place], ends[place]]);
  const [width, begin] = gaps.reduce((widest, gap) => (gap[0] > widest[0] ? gap : widest));
  return width > 1 ? begin + Math.floor(width / 2) : null;
}

// The value at a frame; NaN while there is no keyframe.
export function valueAtFrame(animation, frame) {
  const keys = known(animation);
  if (!keys.length) return NaN;
  const after = keys.findIndex(([other]) => other > frame);
  if (after === 0) return keys[0][1];
  if (after < 0) return keys.at(-1)[1];
  const [[begin, low], [end, high]] = [keys[after - 1], keys[after]];
  const part = (frame - begin) / (end - begin);
  if (animation.interpolation !== "smooth") return (1 - part) * low + part * high;
  const [left, right] = [after - 1, after].map((key) => (end - begin) * slopeAt(keys, key));
  const rest = 1 - part;
  return (
    low * (1 + 2 * part) * rest ** 2 +
    high * part ** 2 * (3 - 2 * part) +
    left * part * rest ** 2 -
    right * part ** 2 * rest
  );
}

// The slope of a smooth curve at a keyframe: Fritsch and Butland, SIAM J. Sci. Stat. Comput. 5, 300 (1984).
function slopeAt(keys, key) {
  if (key === 0 || key === keys.length - 1) return 0;
  const before = keys[key][0] - keys[key - 1][0];
  const after = keys[key + 1][0] - keys[key][0];
  const rises = [(keys[key][1] - keys[key - 1][1]) / before, (keys[key + 1][1] - keys[key][1]) / after];
  if (rises[0] * rises[1] <= 0) return 0;
  const weights = [2 * after + before, after + 2 * before];
  return (weights[0] + weights[1]) / (weights[0] / rises[0] + weights[1] / rises[1]);
}

// Points of the curve, as fractions [x, y] of the plot; y is 0 at the bottom.
export function curveOf(animation, frames, values, count = 96) {
  const [first, last] = frames;
  const [low, high] = values;
  const at = (part) => [part, (valueAtFrame(animation, first + part * (last - first)) - low) / (high - low || 1)];
  if (!known(animation).length) return [];
  return Array.from({ length: count + 1 }, (_, place) => at(place / count));
}
