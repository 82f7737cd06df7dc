// Quilts: the views of a row as the tiles of one picture, as Looking Glass panels take them.
import { presence } from "../painting/views.js";

// The number of columns, somewhat more than rows, as the output `quilt` has it.
export function tileColumns(count) {
  for (let rows = Math.floor(Math.sqrt(count)); rows > 1; rows--) if (count % rows === 0) return count / rows;
  return count;
}

// The quilt of the views in the middle row of an atlas. `tiles` has for each tile the place of the view in the atlas,
// `from`, and its place in the quilt, `to`, in px. The view of the leftmost eye is at the lower left; the others follow
// to the right, and then upward.
export function quiltOf(frameViews) {
  const { atlas, centre, view_cols: width, view_rows: height } = frameViews;
  const away = (v) => Math.abs(v - centre[1]);
  const row = atlas.vs.reduce((best, v, at) => (away(v) < away(atlas.vs[best]) ? at : best), 0);
  const present = presence(frameViews);
  const cols = atlas.us.map((_, col) => col).filter((col) => present[row * atlas.us.length + col]);
  const columns = tileColumns(cols.length);
  const rows = cols.length / columns;
  const tiles = cols.map((col, tile) => ({
    from: { x: col * width, y: row * height },
    to: { x: (tile % columns) * width, y: (rows - 1 - Math.floor(tile / columns)) * height },
  }));
  return {
    ...{ columns, rows, aspect: width / height, tiles, tile: { width, height } },
    ...{ width: columns * width, height: rows * height },
  };
}

// The file of a frame among those of an output `quilt`, such as exports/quilt/0001_qs8x6a0.75.png; null without one.
export function fileOfFrame(files, frame) {
  const start = `/${String(frame).padStart(4, "0")}_qs`;
  return files.find((file) => file.includes(start)) ?? null;
}
