"""Views in one picture for a graphics card."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lippmann.errors import LayoutError
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.views.atlas import atlas_picture, plan_atlas
from lippmann.lightfield.views.square_pixels import as_square
from lippmann.lightfield.views.views import view, view_numbers, views_grid
from tests.unit.lippmann.lightfield.sheets import LAYOUTS, image_of


def light(layout: CellLayout) -> np.ndarray[tuple[int, ...], np.dtype[np.float32]]:
    return np.random.default_rng(1).random((layout.rows, layout.cols, 3), dtype=np.float32)


@given(layout=LAYOUTS, max_px=st.integers(1, 200))
def test_an_atlas_fits_and_shows_each_of_its_views_where_it_says(layout: CellLayout, max_px: int) -> None:
    if max(layout.square_size()) > max_px:
        with pytest.raises(LayoutError, match=f"got {max_px}"):
            plan_atlas(layout, max_px=max_px)
        return
    atlas, sheet = plan_atlas(layout, max_px=max_px), light(layout)
    assert max(atlas.rows, atlas.cols) <= max_px
    picture = atlas_picture(image_of(sheet, layout), atlas)
    assert picture.shape == (atlas.rows, atlas.cols, 3)
    there = set(view_numbers(layout))
    for row, v in enumerate(atlas.vs):
        for col, u in enumerate(atlas.us):
            shown = picture[row * atlas.view_rows :, col * atlas.view_cols :][: atlas.view_rows, : atlas.view_cols]
            expected = as_square(view(sheet, layout, u, v), layout) if (u, v) in there else np.zeros_like(shown)
            np.testing.assert_array_equal(shown, expected)


def test_where_all_views_fit_the_atlas_of_a_square_lattice_is_the_grid_of_views() -> None:
    layout = CellLayout(lens_rows=5, lens_cols=7, px_per_lens=4)
    sheet = light(layout)
    np.testing.assert_array_equal(
        atlas_picture(image_of(sheet, layout), plan_atlas(layout, max_px=28)), views_grid(sheet, layout)
    )


def test_views_that_do_not_all_fit_are_thinned_out_evenly_to_both_ends() -> None:
    layout = CellLayout(lens_rows=10, lens_cols=10, px_per_lens=9)
    atlas = plan_atlas(layout, max_px=50)
    assert atlas.us == atlas.vs == (0, 2, 4, 6, 8)
    assert plan_atlas(layout, max_px=19).us == (4,)
