// The clock of a sequence that plays. It holds its place while the next frame is not loaded, and skips none.

export const SPEEDS = [2, 4, 8, 12, 24]; // frames per second

// The index after some time. `clock` is {index, count, speed_fps, isLooping, since_ms}, where `since_ms` is the time at
// which the index was reached; `isReady(index)` says whether a frame can be shown. `isOver` ends the play.
export function ticked(clock, now_ms, isReady) {
  const { index, count, speed_fps, isLooping, since_ms } = clock;
  const period_ms = 1000 / speed_fps;
  if (now_ms - since_ms < period_ms) return { ...clock, isOver: false };
  const isLast = index + 1 >= count;
  if (count < 2 || (isLast && !isLooping)) return { ...clock, isOver: true };
  const next = isLast ? 0 : index + 1;
  if (!isReady(next)) return { ...clock, isOver: false };
  // A late frame shortens the next period, but a long pause is not made up for.
  const isLate = now_ms - since_ms > 2 * period_ms;
  return { ...clock, index: next, since_ms: isLate ? now_ms : since_ms + period_ms, isOver: false };
}

// The indices that are shown next, nearest first.
export function ahead({ index, count, isLooping }, number) {
  const next = Array.from({ length: Math.min(number, count - 1) }, (_, step) => index + 1 + step);
  return isLooping ? next.map((each) => each % count) : next.filter((each) => each < count);
}
