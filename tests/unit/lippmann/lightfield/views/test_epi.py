"""Epipolar slices: where pixels come from, and the slope that depth draws."""

from __future__ import annotations

import numpy as np
import pytest

from lippmann.errors import LayoutError
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.views.epi import epi_of_col, epi_of_row
from lippmann.lightfield.views.views import grid_size, interlace, view_numbers
from tests.unit.lippmann.lightfield.sheets import image_of

SQUARE = CellLayout(7, 9, 4)


def test_a_slice_of_the_square_lattice_is_every_nth_pixel_of_a_line_read_backward() -> None:
    ortho = np.random.default_rng(1).random((28, 36, 3))
    rows = epi_of_row(image_of(ortho, SQUARE), 5)
    np.testing.assert_array_equal(rows, ortho[5 * 4 + 1].reshape(9, 4, 3)[:, ::-1].transpose(1, 0, 2))
    cols = epi_of_col(image_of(ortho, SQUARE), 3)
    np.testing.assert_array_equal(cols, ortho[:, 3 * 4 + 1].reshape(7, 4, 3)[:, ::-1])


@pytest.mark.parametrize("layout", [SQUARE, CellLayout(8, 9, 4, "hexagonal")])
@pytest.mark.parametrize("delta", [1, -1])
def test_what_is_in_front_moves_to_lower_lenses_as_the_eye_moves_on(layout: CellLayout, delta: int) -> None:
    # Views of a bright point at s = delta n f: an eye further right sees it delta lenses further left.
    grid = np.zeros((*grid_size(layout), 1))
    for u, v in view_numbers(layout):
        grid[v * layout.lens_rows + 4 - delta * (v - 2), u * layout.lens_cols + 4 - delta * (u - 2)] = 1
    ortho = interlace(grid, layout)
    across = epi_of_row(image_of(ortho, layout), int(4 - delta * (layout.cell_rows // 2 - 2)))[:, :, 0]
    np.testing.assert_array_equal(across.argmax(axis=1), 4 - delta * (np.arange(4) - 2))
    if layout.lattice == "square":
        down = epi_of_col(image_of(ortho, layout), 4)[:, :, 0]
        np.testing.assert_array_equal(down.argmax(axis=0), 4 - delta * (np.arange(4) - 2))


def test_vertical_slices_of_hexagons_are_on_square_pixels() -> None:
    layout = CellLayout(8, 9, 4, "hexagonal")
    ortho = np.ones((layout.rows, layout.cols, 3))
    there = int(layout.mask[:, 2].sum())
    np.testing.assert_allclose(epi_of_col(image_of(ortho, layout), 0), np.ones((layout.square_size()[0], there, 3)))


def test_lenses_that_are_not_there_are_refused() -> None:
    ortho = np.zeros((28, 36, 3))
    with pytest.raises(LayoutError, match="lens row from 0 to 6, got 7"):
        epi_of_row(image_of(ortho, SQUARE), 7)
    with pytest.raises(LayoutError, match="lens column from 0 to 8, got -1"):
        epi_of_col(image_of(ortho, SQUARE), -1)
