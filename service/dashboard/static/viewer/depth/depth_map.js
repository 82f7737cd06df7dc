// The depth map of a view: what the service sends, where its surfaces are seen from another eye, and its colours.
// Depths are in mm, positive in front of the display, NaN where they are unknown.

/**
 * The numbers of a PFM, row 0 at the top.
 * @param {ArrayBuffer} buffer
 * @returns {{rows: number, cols: number, depths_mm: Float32Array}}
 */
export function parsePfm(buffer) {
  const bytes = new Uint8Array(buffer);
  const ends = [];
  for (let at = 0; at < bytes.length && ends.length < 3; at++) if (bytes[at] === 0x0a) ends.push(at);
  const [kind, size, scale] = new TextDecoder().decode(bytes.subarray(0, ends[2])).split("\n");
  const [cols, rows] = (size ?? "").split(" ").map(Number);
  const begin = ends[2] + 1;
  if (kind !== "Pf" || !(rows > 0 && cols > 0) || bytes.length !== begin + 4 * rows * cols) {
    throw new Error(`Expected a PFM of one channel, got ${bytes.length} bytes.`);
  }
  const view = new DataView(buffer, begin);
  const isLittle = Number(scale) < 0;
  const depths_mm = new Float32Array(rows * cols);
  for (let row = 0; row < rows; row++) {
    for (let col = 0; col < cols; col++) {
      depths_mm[row * cols + col] = view.getFloat32(4 * ((rows - 1 - row) * cols + col), isLittle);
    }
  }
  return { rows, cols, depths_mm };
}

const SHARE = 0.98; // The share of the pixels whose depth the colours tell apart.

// The depth, on either side of the display, that has the last colour; a round number of mm.
export function deepestShown({ depths_mm }) {
  const there = Array.from(depths_mm.filter(Number.isFinite), Math.abs).sort((one, other) => one - other);
  const found = there.length ? there[Math.min(there.length - 1, Math.floor(SHARE * there.length))] : 0;
  const unit = 10 ** Math.floor(Math.log10(Math.max(found, 1e-3)));
  const steps = [1, 1.5, 2, 3, 4, 5, 6, 8].find((step) => step * unit >= found * (1 - 1e-6)) ?? 10;
  return Number((steps * unit).toPrecision(6));
}

// Linear light from the plane of the display to the farthest depth, as in worker/images/colour.py.
const BEHIND = [[0.55, 0.55, 0.55], [0.1, 0.35, 0.75], [0.03, 0.1, 0.45]]; // prettier-ignore
const IN_FRONT = [[0.55, 0.55, 0.55], [0.95, 0.45, 0.05], [0.6, 0.02, 0.02]]; // prettier-ignore
const coded = (linear) => (linear <= 0.0031308 ? 12.92 * linear : 1.055 * linear ** (1 / 2.4) - 0.055);

// The sRGB codes of a depth: grey at the display, orange to red in front of it, and blue behind it.
export function colourOf(depth_mm, deepest_mm) {
  const colours = depth_mm > 0 ? IN_FRONT : BEHIND;
  const part = Math.min(1, Math.abs(depth_mm) / deepest_mm) * (colours.length - 1);
  const below = Math.min(colours.length - 2, Math.floor(part));
  return colours[below].map((from, channel) => {
    const linear = from + (colours[below + 1][channel] - from) * (part - below);
    return Math.round(255 * coded(linear));
  });
}

// The colours of a legend from the deepest behind to the deepest in front, as a CSS gradient.
export function gradientOf(deepest_mm, steps = 16) {
  const stops = Array.from({ length: steps + 1 }, (_, step) => {
    const part = (2 * step) / steps - 1;
    return `rgb(${colourOf(part * deepest_mm, deepest_mm).join(" ")}) ${(50 * (part + 1)).toFixed(1)}%`;
  });
  return `linear-gradient(to right, ${stops.join(", ")})`;
}

const TOUCHED = 0.25; // A pixel of which a surface covers more than this shows it.
const first = (place) => Math.floor(place + TOUCHED);
const last = (place) => Math.ceil(place - TOUCHED);

// The depth map as another eye sees it: `away` is [right, down], the views between that eye and that of the map, and
// `lenses_per_mm` the pixels that a surface moves against the eye, per view and mm. What is nearer hides what is behind
// it, and what comes out from behind has the depth of the farther neighbour.
export function seenFrom({ rows, cols, depths_mm }, away, lenses_per_mm) {
  const [across, down] = away.map((views, axis) => views * lenses_per_mm[axis]);
  if (across === 0 && down === 0) return depths_mm;
  const seen = new Float32Array(rows * cols).fill(-Infinity);
  for (let row = 0; row < rows; row++) {
    for (let col = 0; col < cols; col++) {
      const depth_mm = depths_mm[row * cols + col];
      const [to_row, to_col] = [row - depth_mm * down, col - depth_mm * across];
      const [bottom, right] = [Math.min(rows - 1, last(to_row)), Math.min(cols - 1, last(to_col))];
      for (let at_row = Math.max(0, first(to_row)); at_row <= bottom; at_row++) {
        for (let at_col = Math.max(0, first(to_col)); at_col <= right; at_col++) {
          const to = at_row * cols + at_col;
          if (depth_mm > seen[to]) seen[to] = depth_mm;
        }
      }
    }
  }
  for (let row = 0; row < rows; row++) fillGaps(seen.subarray(row * cols, (row + 1) * cols), depths_mm, row * cols);
  return seen;
}

function fillGaps(line, depths_mm, first) {
  for (let col = 0; col < line.length; col++) {
    if (line[col] !== -Infinity) continue;
    let end = col;
    while (end < line.length && line[end] === -Infinity) end++;
    const left = col > 0 ? line[col - 1] : NaN;
    const right = end < line.length ? line[end] : NaN;
    const farther = Number.isNaN(left) ? right : Number.isNaN(right) ? left : Math.min(left, right);
    // Where the map knows no depth either, as in the sky, it stays unknown.
    for (; col < end; col++) line[col] = Number.isFinite(depths_mm[first + col]) ? farther : NaN;
  }
}

// The pixels of the overlay, four codes each; transparent where the depth is unknown.
export function overlayPixels(depths_mm, deepest_mm) {
  const pixels = new Uint8ClampedArray(4 * depths_mm.length);
  depths_mm.forEach((depth_mm, index) => {
    if (!Number.isFinite(depth_mm)) return;
    pixels.set(colourOf(depth_mm, deepest_mm), 4 * index);
    pixels[4 * index + 3] = 255;
  });
  return pixels;
}

// The depth at a part of the picture, 0 to 1.
export function depthAt({ rows, cols, depths_mm }, across, down) {
  const [row, col] = [Math.min(rows - 1, Math.floor(down * rows)), Math.min(cols - 1, Math.floor(across * cols))];
  return depths_mm[row * cols + col];
}
