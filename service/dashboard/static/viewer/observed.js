// What an observer of a display sees, in numbers. Positions are in mm from the middle of the display: right, up, away.

// The width of the viewing zone of a lens at a distance.
export const zoneOf = ({ pitch_mm }, gap_mm, away_mm) => (pitch_mm * away_mm) / gap_mm;

// The share of the lenses that show their own cell, to the eye of two that sees fewer of them; the others show the cell
// of a neighbour.
export function ownShare(frameViews, eye, gap_mm, apart_mm = 0) {
  const shareOf = frameViews.lattice === "square" ? squareShare : hexagonalShare;
  return Math.min(...[-1, 1].map((side) => shareOf(frameViews, { ...eye, x: eye.x + (side * apart_mm) / 2 }, gap_mm)));
}

function squareShare({ lens_rows, lens_cols, pitch_mm }, eye, gap_mm) {
  const half_mm = (pitch_mm * eye.z) / gap_mm / 2;
  const seen = (lenses, at_mm) => {
    const places = Array.from({ length: lenses }, (_, lens) => (lens - (lenses - 1) / 2) * pitch_mm);
    return places.filter((place_mm) => Math.abs(at_mm - place_mm) <= half_mm).length / lenses;
  };
  return seen(lens_cols, eye.x) * seen(lens_rows, eye.y);
}

// Every other row stands half a pitch further right, and the cell is a hexagon with a corner at the top; see
// lippmann/lattice/hexagonal.py.
function hexagonalShare({ lens_rows, lens_cols, pitch_mm }, eye, gap_mm) {
  const zone_mm = (pitch_mm * eye.z) / gap_mm; // between opposite sides
  let own = 0;
  for (let row = 0; row < lens_rows; row++) {
    const down =
      (Math.sqrt(3) * Math.abs(-eye.y - (row - (lens_rows - 1) / 2) * (Math.sqrt(3) / 2) * pitch_mm)) / zone_mm;
    const first = 0.5 + (row % 2) / 2 - (lens_cols + 0.5) / 2;
    for (let col = 0; col < lens_cols; col++) {
      const across = Math.abs(eye.x - (first + col) * pitch_mm) / zone_mm;
      if (Math.max(2 * across, across + down) <= 1) own += 1;
    }
  }
  return own / (lens_rows * lens_cols);
}
