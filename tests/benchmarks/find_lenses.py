"""Whether `lippmann import --find` is right, refuses, or is wrong, on pictures of known lenses that went through JPEG.

`python -m tests.benchmarks.find_lenses` prints a table; with `--write`, it writes the table into docs/import.md.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import LayoutError
from lippmann.lattice.cell import Lattice
from lippmann.lightfield.calibrate.calibrate import calibrate_picture
from lippmann.lightfield.sheet.lens_grid import LensGrid
from tests.unit.lippmann.lightfield.elemental_images import FAR, NEAR_AND_FAR, integral_image, light_of, through_jpeg

PAGE = Path("docs/import.md")
TABLE = "<!-- the table is written by `python -m tests.benchmarks.find_lenses --write` -->\n"

LATTICES: tuple[Lattice, ...] = ("square", "hexagonal")
PITCHES_PX = (11.0, 13.37, 16.0, 22.0, 27.3, 41.0, 60.0)
TURNS_DEG = (0.0, -1.7)
QUALITIES = (None, 95, 75, 50, 30)
"""The qualities of JPEG with 4:2:0; None is a picture that was not compressed."""

LENSES_ACROSS = 40
"""Lenses along the longer side, but a side has at most `LONGEST_PX`."""
LONGEST_PX = 900

FITS = 0.002
"""The largest relative error of a pitch that is right."""

RESULTS = ("right", "refused", "wrong")


def cases() -> Iterator[tuple[LensGrid, NDArray[np.uint8]]]:
    """Yield lenses and the picture that they show."""
    for seed, lattice in enumerate(LATTICES):
        for pitch_px in PITCHES_PX:
            for turn_deg in TURNS_DEG:
                # A sheet that a program made begins with a whole cell; a photograph begins anywhere.
                begin = 0.5 if turn_deg == 0 else 0.37
                grid = LensGrid(
                    1, 1, pitch_px=pitch_px, offset_px=(begin * pitch_px, begin * pitch_px), lattice=lattice,
                    turn_deg=turn_deg,
                )  # fmt: skip
                side = min(LONGEST_PX, round(LENSES_ACROSS * pitch_px))
                planes = NEAR_AND_FAR if turn_deg == 0 else FAR
                yield grid, integral_image(grid, (round(0.8 * side), side), planes, seed=seed)


def outcome(grid: LensGrid, codes: NDArray[np.uint8]) -> tuple[str, str]:
    """Return whether the lenses are found right, refused or found wrong, and the words about it."""
    try:
        found = calibrate_picture(light_of(codes))
    except LayoutError as error:
        return "refused", str(error)
    right = abs(found.grid.pitch_px / grid.pitch_px - 1) <= FITS and found.grid.lattice == grid.lattice
    return "right" if right else "wrong", f"{found.grid.pitch_px:.3f} px, {found.agreement:.2f}"


def main() -> int:
    """Count over all cases and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", action="store_true", help=f"write the table into {PAGE}")
    parser.add_argument("--each", action="store_true", help="print every case that is not right")
    options = parser.parse_args()
    counts: Counter[tuple[Lattice, int | None, str]] = Counter()
    for grid, codes in cases():
        for quality in QUALITIES:
            result, said = outcome(grid, codes if quality is None else through_jpeg(codes, quality))
            counts[grid.lattice, quality, result] += 1
            if options.each and result != "right":
                print(f"{grid.lattice} {grid.pitch_px} px {grid.turn_deg} deg, {quality}: {result}: {said}", flush=True)
    lines = ["| lattice | JPEG quality | right | refused | wrong |", "|---|---|---|---|---|"]
    for lattice in LATTICES:
        for quality in QUALITIES:
            figures = " | ".join(str(counts[lattice, quality, result]) for result in RESULTS)
            lines.append(f"| {lattice} | {quality or 'PNG'} | {figures} |")
    print("\n".join(lines))
    if options.write:
        head, mark, rest = PAGE.read_text().partition(TABLE)
        assert mark, f"expected the line of the table in {PAGE}"
        after = rest.lstrip("\n").partition("\n\n")[2]
        PAGE.write_text(head + mark + "\n" + "\n".join(lines) + "\n\n" + after)
    return int(any(counts[key] for key in counts if key[2] == "wrong"))


if __name__ == "__main__":
    sys.exit(main())
