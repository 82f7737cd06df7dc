"""Whether `lippmann import --find` is right, refuses, or is wrong, on pictures of known lenses that went through JPEG.

`python -m tests.benchmarks.find_lenses` prints a table; with `--write`, it writes the table into docs/import.md.
Options restrict the cases, and `--each` prints every case that is not right.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from lippmann.errors import LayoutError
from lippmann.lattice.cell import Lattice
from lippmann.lightfield.calibrate.calibrate import calibrate_picture
from lippmann.lightfield.sheet.lens_grid import LensGrid
from tests.unit.lippmann.lightfield.elemental_images import FAR, NEAR_AND_FAR, integral_image, light_of, through_jpeg

PAGE = Path("docs/import.md")
TABLE = "<!-- the table is written by `python -m tests.benchmarks.find_lenses --write` -->\n"

LATTICES: tuple[Lattice, ...] = ("square", "hexagonal")
PITCHES_PX = (11.0, 12.0, 13.37, 14.0, 16.0, 18.0, 20.0, 22.0, 26.0, 27.3, 41.0, 60.0)
TURNS_DEG = (0.0, -1.7)
QUALITIES = (None, 95, 75, 50, 30, 20, 10)
"""The qualities of JPEG with 4:2:0; None is a picture that was not compressed."""
SCALES = (1.5, 0.8)
"""The scales of a picture after JPEG, by cubic interpolation, so that its blocks are of 12 or 6.4 px."""
SCALED_QUALITIES = (75, 20)
"""The qualities of JPEG before a picture is scaled."""

LENSES_ACROSS = 40
"""Lenses along the longer side, but a side has at most `LONGEST_PX`."""
LONGEST_PX = 900

FITS = 0.002
"""The largest relative error of a pitch that is right."""

RESULTS = ("right", "refused", "wrong")


@dataclass(frozen=True)
class Treatment:
    """How a picture was stored: by JPEG of a quality, then scaled."""

    quality: int | None
    scale: float = 1.0

    def __str__(self) -> str:
        """Return the words of the table."""
        scaled = f", then scaled by {self.scale:g}" if self.scale != 1 else ""
        return f"{self.quality or 'PNG'}{scaled}"

    def apply(self, codes: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Return codes `(rows, cols, 3)` as they come back."""
        stored = codes if self.quality is None else through_jpeg(codes, self.quality)
        if self.scale == 1:
            return stored
        picture = Image.fromarray(stored)
        size = round(picture.width * self.scale), round(picture.height * self.scale)
        return np.asarray(picture.resize(size, Image.Resampling.BICUBIC))

    def pitch_px(self, grid: LensGrid, size: tuple[int, ...]) -> float:
        """Return the pitch of lenses of a picture of a size (rows, cols) afterwards."""
        return grid.pitch_px * round(size[1] * self.scale) / size[1]


TREATMENTS = (
    *(Treatment(quality) for quality in QUALITIES),
    *(Treatment(quality, scale) for scale in SCALES for quality in SCALED_QUALITIES),
)


def cases(pitches_px: tuple[float, ...]) -> Iterator[tuple[LensGrid, NDArray[np.uint8]]]:
    """Yield lenses and the picture that they show."""
    for seed, lattice in enumerate(LATTICES):
        for pitch_px in pitches_px:
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


def outcome(grid: LensGrid, codes: NDArray[np.uint8], treatment: Treatment) -> tuple[str, str]:
    """Return whether the lenses are found right, refused or found wrong, and the words about it."""
    pitch_px = treatment.pitch_px(grid, codes.shape)
    try:
        found = calibrate_picture(light_of(treatment.apply(codes)))
    except LayoutError as error:
        return "refused", str(error)
    right = abs(found.grid.pitch_px / pitch_px - 1) <= FITS and found.grid.lattice == grid.lattice
    return "right" if right else "wrong", f"{found.grid.pitch_px:.3f} px for {pitch_px:.3f} px, {found.agreement:.2f}"


def main() -> int:
    """Count over all cases and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", action="store_true", help=f"write the table of all cases into {PAGE}")
    parser.add_argument("--each", action="store_true", help="print every case that is not right")
    parser.add_argument("--pitch", type=float, action="append", help="only this pitch, px; it may be repeated")
    parser.add_argument("--quality", type=int, action="append", help="only this quality; 0 is a picture without JPEG")
    parser.add_argument("--scale", type=float, action="append", help="only this scale after JPEG; 1 is none")
    options = parser.parse_args()
    treatments = [
        one
        for one in TREATMENTS
        if (options.quality is None or (one.quality or 0) in options.quality)
        and (options.scale is None or one.scale in options.scale)
    ]
    pitches_px = tuple(options.pitch or PITCHES_PX)
    if options.write and (pitches_px, len(treatments)) != (PITCHES_PX, len(TREATMENTS)):
        parser.error("expected all cases with --write")
    counts: Counter[tuple[Lattice, Treatment, str]] = Counter()
    for grid, codes in cases(pitches_px):
        for treatment in treatments:
            result, said = outcome(grid, codes, treatment)
            counts[grid.lattice, treatment, result] += 1
            if options.each and result != "right":
                print(
                    f"{grid.lattice} {grid.pitch_px} px {grid.turn_deg} deg, {treatment}: {result}: {said}", flush=True
                )
    lines = ["| lattice | JPEG quality | right | refused | wrong |", "|---|---|---|---|---|"]
    for lattice in LATTICES:
        for treatment in treatments:
            figures = " | ".join(str(counts[lattice, treatment, result]) for result in RESULTS)
            lines.append(f"| {lattice} | {treatment} | {figures} |")
    print("\n".join(lines))
    if options.write:
        head, mark, rest = PAGE.read_text().partition(TABLE)
        assert mark, f"expected the line of the table in {PAGE}"
        after = rest.lstrip("\n").partition("\n\n")[2].lstrip("\n")
        PAGE.write_text(head + mark + "\n" + "\n".join(lines) + "\n\n" + after)
    return int(any(counts[key] for key in counts if key[2] == "wrong"))


if __name__ == "__main__":
    sys.exit(main())
