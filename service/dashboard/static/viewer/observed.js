// What an observer of a display sees, in numbers. Positions are in mm from the middle of the display: right, up, away.

// The width of the viewing zone of a lens at a distance.
export const zoneOf = ({ pitch_mm }, gap_mm, away_mm) => (pitch_mm * away_mm) / gap_mm;

// The share of the lenses that show their own cell, to the eye of two that sees fewer of them; the others show the cell
// of a neighbour. Null on the hexagonal lattice, whose cells are no squares.
export function ownShare({ lattice, lens_rows, lens_cols, pitch_mm }, eye, gap_mm, apart_mm = 0) {
  if (lattice !== "square") return null;
  const half_mm = (pitch_mm * eye.z) / gap_mm / 2;
  const seen = (lenses, at_mm) => {
    const places = Array.from({ length: lenses }, (_, lens) => (lens - (lenses - 1) / 2) * pitch_mm);
    return places.filter((place_mm) => Math.abs(at_mm - place_mm) <= half_mm).length / lenses;
  };
  const across = Math.min(seen(lens_cols, eye.x - apart_mm / 2), seen(lens_cols, eye.x + apart_mm / 2));
  return across * seen(lens_rows, eye.y);
}
