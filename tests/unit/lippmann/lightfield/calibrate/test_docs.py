"""The bounds in docs/import.md hold."""

from __future__ import annotations

import re

import pytest

from lippmann.lattice.cell import Lattice
from lippmann.lightfield.calibrate.calibrate import calibrate_white_image
from lippmann.lightfield.sheet.lens_grid import LensGrid
from tests.repository import DOCS
from tests.unit.lippmann.lightfield.lens_pictures import off_lattice_px, white_image

ROWS = re.findall(
    r"^\| (\d+) lenses across \| ([0-9.]+) % \| ([0-9.]+)° \| ([0-9.]+) px \|$",
    (DOCS / "import.md").read_text("utf-8"),
    re.MULTILINE,
)
GRIDS = [(6.3, -3.0), (6.3, 0.8), (14.213, 3.0), (25.7, 0.8), (39.6, -3.0)]
"""Pitch in px and rotation in degrees."""


def test_the_page_has_three_rows_of_bounds() -> None:
    assert [int(across) for across, *_ in ROWS] == [8, 20, 50]


@pytest.mark.parametrize("row", ROWS, ids=lambda row: f"{row[0]} lenses")
@pytest.mark.parametrize("lattice", ["square", "hexagonal"])
def test_a_white_image_is_calibrated_within_the_bounds_of_the_page(row: tuple[str, ...], lattice: Lattice) -> None:
    across, pitch_percent, rotation_deg, place_px = map(float, row)
    for pitch_px, turn_deg in GRIDS:
        if across * pitch_px > 600:
            continue  # a picture that is as large takes seconds and shows nothing else
        grid = LensGrid(1, 1, pitch_px=pitch_px, offset_px=(5.2, 9.9), lattice=lattice, turn_deg=turn_deg)
        side = round(1.02 * across * pitch_px)
        found = calibrate_white_image(white_image(grid, (side, side), noise=0.05)).grid
        assert found.pitch_px == pytest.approx(pitch_px, rel=pitch_percent / 100)
        assert found.turn_deg == pytest.approx(turn_deg, abs=rotation_deg)
        assert off_lattice_px(grid, found) < place_px
