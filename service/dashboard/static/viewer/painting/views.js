// The views at a position of the eye. A place is (x, y) from -1 to 1, the outermost views; right and down are positive.

export const clamp = (value, low = -1, high = 1) => Math.min(high, Math.max(low, value));

// Convert a place to fractional view numbers and back; with a single view, every place is that view.
export const numbersAt = ({ us, vs }, { x, y }) => [((x + 1) / 2) * (us - 1), ((y + 1) / 2) * (vs - 1)];
export const placeOf = ({ us, vs }, u, v) => ({ x: toPlace(u, us), y: toPlace(v, vs) });
const toPlace = (number, count) => (count > 1 ? clamp((2 * number) / (count - 1) - 1) : 0);

// The next view in a direction. It is sharp, because it is not interpolated.
export function nextPlace(frameViews, place, [across, down]) {
  const [u, v] = numbersAt(frameViews, place);
  return placeOf(frameViews, across ? step(u, across) : u, down ? step(v, down) : v);
}
const step = (number, by) => (by > 0 ? Math.floor(number + 1e-6) + 1 : Math.ceil(number - 1e-6) - 1);

// The existing view that is nearest to a place.
export function nearestView(frameViews, place) {
  const missing = new Set(frameViews.missing.map(String));
  const [u, v] = numbersAt(frameViews, place);
  let best = frameViews.centre;
  for (let row = 0; row < frameViews.vs; row++) {
    for (let col = 0; col < frameViews.us; col++) {
      const isNearer = Math.hypot(col - u, row - v) < Math.hypot(best[0] - u, best[1] - v);
      if (isNearer && !missing.has(String([col, row]))) best = [col, row];
    }
  }
  return best;
}

// The place of the view of an atlas that is nearest to the central one; it is sharp, because it is not interpolated.
export function homeOf(frameViews, { us, vs }) {
  const nearest = (numbers, number) =>
    numbers.reduce((best, each) => (Math.abs(each - number) < Math.abs(best - number) ? each : best));
  const [u, v] = frameViews.centre;
  return placeOf(frameViews, nearest(us, u), nearest(vs, v));
}

export const isWhole = ({ atlas, us, vs }) => atlas.us.length === us && atlas.vs.length === vs;

// For every cell of an atlas, by rows: whether it contains a view.
export function presence({ atlas, missing }) {
  const gone = new Set(missing.map(String));
  return atlas.vs.flatMap((v) => atlas.us.map((u) => !gone.has(String([u, v]))));
}

// For every cell of an atlas: the [col, row] of its view, or of the nearest existing one.
export function substitutes(frameViews) {
  const { us, vs } = frameViews.atlas;
  const cells = vs.flatMap((v, row) => us.map((u, col) => ({ u, v, at: [col, row] })));
  const present = presence(frameViews);
  const there = cells.filter((_, index) => present[index]);
  const isThere = new Set(there);
  const away = (cell, other) => Math.hypot(cell.u - other.u, cell.v - other.v);
  const nearest = (cell) => there.reduce((best, other) => (away(cell, other) < away(cell, best) ? other : best));
  return cells.map((cell) => (isThere.has(cell) ? cell : nearest(cell)).at);
}

// The four cells around a place with their weights, which add up to 1: [{at: [col, row], number: [u, v], share}].
export function blend(frameViews, stands, place) {
  const [u, v] = numbersAt(frameViews, place);
  const { us, vs } = frameViews.atlas;
  const [col, across] = between(us, u);
  const [row, down] = between(vs, v);
  const corners = [
    [0, 0, (1 - across) * (1 - down)],
    [1, 0, across * (1 - down)],
    [0, 1, (1 - across) * down],
    [1, 1, across * down],
  ];
  return corners.map(([right, below, share]) => {
    const index = Math.min(row + below, vs.length - 1) * us.length + Math.min(col + right, us.length - 1);
    const at = stands[index];
    return { at, number: [us[at[0]], vs[at[1]]], share };
  });
}

// The position of a number among rising ones: the index before it, and the fraction of the way to the next.
function between(numbers, number) {
  const after = numbers.findIndex((each) => each > number);
  if (after === 0) return [0, 0];
  if (after < 0) return [numbers.length - 1, 0];
  return [after - 1, (number - numbers[after - 1]) / (numbers[after] - numbers[after - 1])];
}
