// A film strip: where it is scrolled to, and where keys lead.

// The place to which a strip is scrolled, so that a column and those beside it are seen. It moves as little as it can.
export function scrolledTo(column, left_px, width_px, step_px) {
  const most = (column - 1) * step_px;
  const least = (column + 2) * step_px - width_px;
  // Where the three do not fit, the column is in the middle.
  if (least > most) return Math.max(0, (column + 0.5) * step_px - width_px / 2);
  return Math.max(0, Math.min(most, Math.max(least, left_px)));
}

// The place, among `count` frames that are done, to which a key leads from the places around the present one; null for
// other keys.
export function placeByKey(key, { before, after }, count) {
  if (key === "ArrowLeft") return Math.max(0, before);
  if (key === "ArrowRight") return Math.min(count - 1, after);
  if (key === "Home") return 0;
  if (key === "End") return count - 1;
  return null;
}
