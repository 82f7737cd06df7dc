// A grid of small squares, one for each frame: where they are, and which one is at a place.

const MAX_HEIGHT_PX = 1600;
const LOW_PX = 420;
// The distance from square to square: the first that makes the grid low.
const SIZES_PX = [22, 16, 12, 9, 7, 5, 4, 3];

// The grid of some frames on some width: columns, rows, and the distance from square to square.
export function gridOf(total, width_px) {
  const width = Math.max(width_px, SIZES_PX.at(-1));
  const at = (step_px) => {
    const cols = Math.max(1, Math.floor(width / step_px));
    const rows = Math.ceil(total / cols);
    return { cols, rows, step_px, total, height_px: rows * step_px };
  };
  const grids = SIZES_PX.map(at);
  return (
    grids.find((grid) => grid.height_px <= LOW_PX) ??
    grids.find((grid) => grid.height_px <= MAX_HEIGHT_PX) ??
    grids.at(-1)
  );
}

// The number of the square at a place, -1 if there is none.
export function squareAt(grid, x_px, y_px) {
  const col = Math.floor(x_px / grid.step_px);
  const row = Math.floor(y_px / grid.step_px);
  const square = row * grid.cols + col;
  return col < 0 || col >= grid.cols || row < 0 || square >= grid.total ? -1 : square;
}

// The left and the top edge of a square; the inverse of `squareAt`.
export function placeOf(grid, square) {
  return [(square % grid.cols) * grid.step_px, Math.floor(square / grid.cols) * grid.step_px];
}

// The square to which a key leads from another one; null for other keys.
export function squareByKey(grid, square, key) {
  const steps = { ArrowLeft: -1, ArrowRight: 1, ArrowUp: -grid.cols, ArrowDown: grid.cols };
  if (key === "Home") return 0;
  if (key === "End") return grid.total - 1;
  if (!Object.hasOwn(steps, key)) return null;
  const next = square + steps[key];
  return next < 0 || next >= grid.total ? square : next;
}
