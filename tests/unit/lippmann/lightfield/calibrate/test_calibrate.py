"""Lenses found in pictures: from white images of known lattices, and in integral images of known scenes."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, get_args

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from lippmann.errors import LayoutError
from lippmann.lattice.cell import Lattice
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.calibrate.calibrate import calibrate_picture, calibrate_white_image
from lippmann.lightfield.calibrate.whole_lenses import (
    are_whole,
    in_middle,
    lens_place,
    lenses_from_first,
    lenses_in_middle,
    whole_lenses,
)
from lippmann.lightfield.sheet.lens_grid import LensGrid, layout_grid
from lippmann.lightfield.sheet.rectify import rectify
from tests.unit.lippmann.lightfield.lens_pictures import off_lattice_px, white_image
from tests.unit.lippmann.lightfield.textures import sheet_of_texture

LATTICES: st.SearchStrategy[Lattice] = st.sampled_from(get_args(Lattice))


@st.composite
def _grids(draw: st.DrawFn) -> LensGrid:
    lattice: Lattice = draw(LATTICES)
    pitch = draw(st.floats(6, 40))
    place = draw(st.tuples(st.floats(0, 1), st.floats(0, 1)))
    return LensGrid(
        1, 1, pitch_px=pitch, offset_px=(place[0] * pitch, place[1] * pitch), lattice=lattice,
        turn_deg=draw(st.floats(-3, 3)),
    )  # fmt: skip


@settings(max_examples=15, deadline=None)
@given(grid=_grids(), look=st.sampled_from(["vignetted", "spot", "bordered"]), noise=st.sampled_from([0.0, 0.02, 0.1]))
def test_a_white_image_tells_the_lattice(grid: LensGrid, look: str, noise: float) -> None:
    size = (300, 360)
    found = calibrate_white_image(white_image(grid, size, look=look, noise=noise)).grid
    # Fewer lenses average less noise: a tenth of a pixel over the whole picture, times what pitch and noise add.
    # The largest errors of pitch, row pitch and turn over 410 random grids are 0.7 to 0.8 of these bounds.
    exact = 0.1 / max(size) * (1 + grid.pitch_px / 20 + 20 * noise)
    assert found.lattice == grid.lattice
    assert found.pitch_px == pytest.approx(grid.pitch_px, rel=1.5 * exact)
    assert found.row_px == pytest.approx(grid.row_px, rel=2 * exact)
    assert found.turn_deg == pytest.approx(grid.turn_deg, abs=math.degrees(1.5 * exact))
    # The error in px is the pitch times the error of a phase, which is the noise over the amplitude of the wave of the
    # lattice. The amplitude of walls one pixel wide falls as the pitch grows, so the error grows with its square. Over
    # the same grids it is at most 0.03 px without noise, and 0.46 px with noise of 0.1 at a pitch of 39 px.
    assert off_lattice_px(grid, found) < 0.04 + 6 * noise * (grid.pitch_px / 40) ** 2
    assert are_whole(found, size)


@pytest.mark.parametrize("lattice", ["square", "hexagonal"])
def test_of_many_lenses_pitch_and_place_are_what_a_print_needs(lattice: Lattice) -> None:
    grid = LensGrid(1, 1, pitch_px=14.213, offset_px=(5.2, 9.9), lattice=lattice, turn_deg=0.8)
    found = calibrate_white_image(white_image(grid, (700, 900), noise=0.05)).grid
    assert found.pitch_px == pytest.approx(grid.pitch_px, rel=1e-4)
    assert found.row_px == pytest.approx(grid.row_px, rel=1e-4)
    assert off_lattice_px(grid, found) < 0.05


def test_neither_half_nor_twice_the_pitch_when_every_second_lens_is_dimmer() -> None:
    layout = CellLayout(30, 30, 12)
    image = white_image(layout_grid(layout), (layout.rows, layout.cols))
    dimmer = np.ones(30)
    dimmer[::2] = 0.9
    found = calibrate_white_image(image * np.repeat(dimmer, 12)[:, np.newaxis]).grid
    assert found.pitch_px == pytest.approx(12, rel=1e-3)
    assert found.row_px == pytest.approx(12, rel=1e-3)
    assert (found.lens_rows, found.lens_cols) == (30, 30)


@pytest.mark.parametrize("name", ["flat", "noise", "slope"])
def test_what_is_no_white_image_is_refused(name: str) -> None:
    rng = np.random.default_rng(1)
    slope = np.linspace(0, 1, 200)[:, np.newaxis, np.newaxis] * np.ones((1, 200, 3))
    picture = {"flat": np.ones((200, 200, 3)), "noise": rng.random((200, 200, 3)), "slope": slope}[name]
    with pytest.raises(LayoutError, match="expected a white image of a regular array of lenses"):
        calibrate_white_image(picture)
    with pytest.raises(LayoutError, match="give the pitch"):
        calibrate_picture(picture)


def test_hexagons_on_their_side_are_refused() -> None:
    grid = LensGrid(1, 1, pitch_px=15, offset_px=(7.5, 7.5), lattice="hexagonal")
    lying = white_image(grid, (300, 300)).transpose(1, 0, 2)
    with pytest.raises(LayoutError, match="square or hexagonal with level rows"):
        calibrate_white_image(lying)


def _scene(layout: CellLayout, depth_mm: float) -> NDArray[np.float32]:
    """Return the sheet of a plane of stains, `(rows, cols, 1)`."""
    rng = np.random.default_rng(3)
    stains = [(*rng.uniform(-25, 25, 2), rng.uniform(0.5, 2.5), rng.uniform(0.2, 1)) for _ in range(160)]

    def texture(x: NDArray[Any], y: NDArray[Any]) -> NDArray[np.float64]:
        light = np.full(np.broadcast_shapes(x.shape, y.shape), 0.1)
        for at_x, at_y, wide, bright in stains:
            light = np.where((x - at_x) ** 2 + (y - at_y) ** 2 < wide**2, bright, light)
        return light

    return sheet_of_texture(layout, texture, depth_mm, focal_mm=3.3)


@pytest.mark.parametrize(("lattice", "depth_mm"), [("square", -30.0), ("square", 20.0), ("hexagonal", -15.0)])
def test_a_picture_tells_the_pitch_and_not_the_step_at_which_what_it_shows_repeats(
    lattice: Lattice, depth_mm: float
) -> None:
    layout = CellLayout(40, 40, 16, lattice)
    found = calibrate_picture(_scene(layout, depth_mm))
    # What is shown repeats every 16 (1 +- f / s) px: 11 to 20 % beside the pitch.
    assert found.grid.lattice == lattice
    assert found.grid.pitch_px == pytest.approx(16, rel=1e-3)
    assert off_lattice_px(layout_grid(layout), found.grid) < 0.5


def test_a_picture_that_repeats_as_clearly_otherwise_breaks_off_only_at_its_lenses() -> None:
    layout = CellLayout(40, 40, 16, "hexagonal")
    picture = _scene(layout, -30.0)
    # What is shown repeats every 14.2 px, and its edges make lines as clear as those of the lenses.
    for near_px in (None, 16.3):
        found = calibrate_picture(picture, near_px=near_px).grid
        assert found.pitch_px == pytest.approx(16, rel=5e-4)
        assert found.row_px == pytest.approx(13, rel=5e-4)
        assert off_lattice_px(layout_grid(layout), found) < 0.2


def test_a_turned_picture_tells_its_turn() -> None:
    layout = CellLayout(40, 40, 16)
    turned = LensGrid(40, 40, pitch_px=15.3, offset_px=(30.0, 12.0), turn_deg=-1.7)
    # From whole cells to a turned lattice: nearest pixels, so that borders stay steps.
    sheet = _scene(layout, -30.0)[..., 0]
    row, col = np.mgrid[:660, :660] + 0.5
    turn = math.radians(turned.turn_deg)
    right, down = col - turned.offset_px[1], row - turned.offset_px[0]
    x = (right * math.cos(turn) + down * math.sin(turn)) / 15.3 * 16 + 8
    y = (down * math.cos(turn) - right * math.sin(turn)) / 15.3 * 16 + 8
    inside = (x >= 0) & (x < 640) & (y >= 0) & (y < 640)
    picture = np.where(inside, sheet[y.astype(int).clip(0, 639), x.astype(int).clip(0, 639)], 0)[..., np.newaxis]
    found = calibrate_picture(picture).grid
    assert found.pitch_px == pytest.approx(15.3, rel=1e-3)
    assert found.turn_deg == pytest.approx(-1.7, abs=0.05)
    assert off_lattice_px(turned, found) < 0.6


def any_lens_is_whole(grid: LensGrid, size: tuple[int, int]) -> bool:
    """Return whether any lens is whole on a picture of at most 300 x 300 px, by a look at every lens on it."""
    # The first lens is less than a pitch from the corner, and a turn of 3 degrees leads less than 8 lenses aside.
    numbers = range(-8, round(300 / grid.row_px) + 8)
    places = (lens_place(grid, row, col + grid.shift_pitches(row)) for row in numbers for col in numbers)
    return any(
        are_whole(replace(grid, offset_px=(down, right)), size)
        for down, right in places
        if 0 < down < size[0] and 0 < right < size[1]
    )


LONE_HEXAGON = LensGrid(1, 1, pitch_px=40.0, offset_px=(30.0, 22.0), lattice="hexagonal")
"""The only lens that is whole on 60 x 50 px: half a pitch to either side none would be."""


@settings(max_examples=60)
@given(grid=_grids(), rows=st.integers(24, 300), cols=st.integers(24, 300))
@example(grid=LONE_HEXAGON, rows=60, cols=50)
def test_the_block_of_whole_lenses_is_whole_and_no_more_would_fit(grid: LensGrid, rows: int, cols: int) -> None:
    size = (rows, cols)
    if not any_lens_is_whole(grid, size):
        with pytest.raises(LayoutError, match="expected a whole lens"):
            whole_lenses(grid, size)
        return
    block = whole_lenses(grid, size)
    assert are_whole(block, size)
    assert off_lattice_px(grid, block) < 1e-6
    assert lenses_from_first(block, size) == block
    below = LensGrid(**{**vars(block), "lens_rows": block.lens_rows + 2})
    beside = LensGrid(**{**vars(block), "lens_cols": block.lens_cols + 2})
    assert not are_whole(below, size)
    assert not are_whole(beside, size)


@given(layout=st.builds(CellLayout, st.integers(2, 9), st.integers(2, 9), st.sampled_from([4, 8, 14]), LATTICES))
def test_a_sheet_of_whole_cells_is_found_whole_in_its_middle(layout: CellLayout) -> None:
    grid, size = layout_grid(layout), (layout.rows, layout.cols)
    assert lenses_in_middle(grid, size) == in_middle(grid, size)
    assert in_middle(grid, size).offset_px == pytest.approx(grid.offset_px)


def test_sheets_that_divide_by_a_printers_pitch_to_half_a_pixel_keep_all_their_lenses() -> None:
    grid = lenses_in_middle(LensGrid(1, 1, pitch_px=600 / 25.4, offset_px=(0, 0)), (2362, 2362))
    assert (grid.lens_rows, grid.lens_cols) == (100, 100)


def test_found_lenses_become_whole_cells_that_are_lit_in_their_middles() -> None:
    grid = LensGrid(1, 1, pitch_px=11.37, offset_px=(7, 3), lattice="hexagonal", turn_deg=2)
    image = white_image(grid, (200, 240), look="spot", noise=0.0)
    found = calibrate_white_image(image).grid
    sheet = rectify(image, found)
    layout = found.layout()
    m, n, o = layout.row_px, layout.px_per_lens, layout.overhang_px
    for lens_row in range(layout.lens_rows):
        left = layout.shift_px(lens_row)
        cell = sheet[o + lens_row * m : o + (lens_row + 1) * m, left : left + n, 0]
        at_row, at_col = np.unravel_index(np.argmax(cell), cell.shape)
        assert abs(at_row - (m - 1) / 2) <= 1
        assert abs(at_col - (n - 1) / 2) <= 1
