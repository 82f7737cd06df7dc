"""Lenses in pictures that went through JPEG: its blocks are a grid too, and are not taken for lenses."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from lippmann.errors import LayoutError
from lippmann.lattice.cell import Lattice
from lippmann.lightfield.calibrate.calibrate import calibrate_picture
from lippmann.lightfield.sheet.lens_grid import LensGrid
from tests.unit.lippmann.lightfield.elemental_images import FAR, integral_image, light_of, photograph, through_jpeg
from tests.unit.lippmann.lightfield.lens_pictures import off_lattice_px

SIZE = (352, 418)


def _grid(pitch_px: float, lattice: Lattice = "square", turn_deg: float = 0.0) -> LensGrid:
    return LensGrid(1, 1, pitch_px=pitch_px, offset_px=(pitch_px / 2, pitch_px / 2), lattice=lattice, turn_deg=turn_deg)


@cache
def _integral_image(grid: LensGrid) -> NDArray[np.uint8]:
    return integral_image(grid, SIZE, FAR)


@pytest.mark.parametrize("quality", [90, 50])
@pytest.mark.parametrize("grid", [_grid(22.0), _grid(17.3, turn_deg=1.2)], ids=["22", "17.3"])
def test_the_lenses_are_found_behind_the_blocks(grid: LensGrid, quality: int) -> None:
    found = calibrate_picture(light_of(through_jpeg(_integral_image(grid), quality))).grid
    assert found.pitch_px == pytest.approx(grid.pitch_px, rel=2e-3)
    assert found.turn_deg == pytest.approx(grid.turn_deg, abs=0.1)
    assert off_lattice_px(grid, found) < 1


@pytest.mark.parametrize("quality", [75, 40, 15])
def test_a_photograph_without_lenses_is_refused(quality: int) -> None:
    with pytest.raises(LayoutError, match="give the pitch"):
        calibrate_picture(light_of(through_jpeg(photograph(SIZE), quality)))


@pytest.mark.parametrize("times", [1, 2, 1.5])
def test_blocks_alone_are_refused_with_the_reason_also_when_the_picture_was_enlarged(times: float) -> None:
    codes = through_jpeg(photograph(SIZE), 10)
    enlarged = Image.fromarray(codes).resize((round(times * SIZE[1]), round(times * SIZE[0])), Image.Resampling.NEAREST)
    with pytest.raises(LayoutError, match=r"blocks|no lattice|none that is certain"):
        calibrate_picture(light_of(np.asarray(enlarged)))


def test_lenses_as_large_as_blocks_are_refused_with_the_reason() -> None:
    light: NDArray[Any] = light_of(_integral_image(_grid(8.0)))
    for near_px in (None, 8.0):
        with pytest.raises(LayoutError, match="blocks of JPEG"):
            calibrate_picture(light, near_px=near_px)


@pytest.mark.parametrize(("pitch_px", "quality", "scale"), [(20.0, 10, 1.0), (13.37, 20, 1.0), (12.0, 20, 1.5)])
def test_twice_the_pitch_is_not_taken_for_it_after_strong_compression(
    pitch_px: float, quality: int, scale: float
) -> None:
    grid = LensGrid(1, 1, pitch_px=pitch_px, offset_px=(pitch_px / 2, pitch_px / 2))
    codes = through_jpeg(integral_image(grid, (400, 500), FAR, seed=3), quality)
    picture = Image.fromarray(codes)
    larger = picture.resize((round(picture.width * scale), round(picture.height * scale)), Image.Resampling.BICUBIC)
    found = calibrate_picture(light_of(np.asarray(larger)))
    assert found.grid.pitch_px == pytest.approx(scale * pitch_px, rel=0.002)


@pytest.mark.parametrize(("is_turned", "name"), [(False, "pitch"), (True, "row pitch")])
def test_a_pitch_that_scaled_blocks_draw_away_along_one_axis_is_refused(is_turned: bool, name: str) -> None:
    grid = LensGrid(1, 1, pitch_px=13.37, offset_px=(13.37 / 2, 13.37 / 2))
    codes = Image.fromarray(integral_image(grid, (400, 500), FAR, seed=7)).resize((500, 399), Image.Resampling.BICUBIC)
    turned = codes.transpose(Image.Transpose.TRANSPOSE) if is_turned else codes
    blocks = Image.fromarray(through_jpeg(np.asarray(turned), 7))
    larger = blocks.resize((blocks.width * 3 // 2, blocks.height * 3 // 2), Image.Resampling.BICUBIC)
    with pytest.raises(LayoutError, match=rf"whose {name} is uncertain, 20\.00 px .*, or 20\.\d+ px by the lines"):
        calibrate_picture(light_of(np.asarray(larger)))


@pytest.mark.parametrize("quality", [8, 5])
def test_a_pitch_that_scaled_blocks_draw_away_is_refused_with_the_reason(quality: int) -> None:
    grid = LensGrid(1, 1, pitch_px=13.37, offset_px=(13.37 / 2, 13.37 / 2))
    codes = through_jpeg(integral_image(grid, (400, 500), FAR, seed=7), quality)
    larger = Image.fromarray(codes).resize((750, 600), Image.Resampling.BICUBIC)
    with pytest.raises(LayoutError, match=r"whose pitch is uncertain, 20\.00 px .*: another grid, of .* is clearer"):
        calibrate_picture(light_of(np.asarray(larger)))
