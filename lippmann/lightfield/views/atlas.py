"""Atlas: as many views as fit into the largest texture of a graphics card, in one picture."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import LayoutError
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.image import IntegralImage
from lippmann.lightfield.views.square_pixels import as_square
from lippmann.lightfield.views.views import view, view_numbers


@dataclass(frozen=True)
class Atlas:
    """The places of the views in an atlas: view (`us[i]`, `vs[j]`) is at grid column i and grid row j."""

    us: tuple[int, ...]
    """Rising, as the eye moves to the right."""
    vs: tuple[int, ...]
    """Rising, as it moves down."""
    view_rows: int
    view_cols: int
    """The width of one view on square pixels, px."""

    @property
    def rows(self) -> int:
        """Height, px."""
        return len(self.vs) * self.view_rows

    @property
    def cols(self) -> int:
        """Width, px."""
        return len(self.us) * self.view_cols


def plan_atlas(layout: CellLayout, *, max_px: int) -> Atlas:
    """Choose as many views as fit, evenly spread; several include the outermost ones.

    Parameters
    ----------
    layout
        Of the orthoscopic sheet.
    max_px
        The longest side that the picture may have.

    Raises
    ------
    LayoutError
        If not even one view fits.

    Examples
    --------
    >>> plan_atlas(CellLayout(90, 90, 8), max_px=360).us
    (0, 2, 5, 7)
    """
    rows, cols = layout.square_size()
    if max(rows, cols) > max_px:
        raise LayoutError(f"expected max_px of at least one view, {max(rows, cols)} px, got {max_px}")
    return Atlas(
        us=_spread(layout.cell_cols, max_px // cols), vs=_spread(layout.cell_rows, max_px // rows),
        view_rows=rows, view_cols=cols,
    )  # fmt: skip


def atlas_picture(image: IntegralImage, atlas: Atlas) -> NDArray[np.floating[Any]]:
    """Return the picture of an atlas, `(atlas.rows, atlas.cols, channel)`; black where there is no view.

    Parameters
    ----------
    image
        An orthoscopic image.
    atlas
        Which views lie where.

    Raises
    ------
    LayoutError
        If the image is pseudoscopic.
    """
    image.check_orthoscopic()
    pixels, layout = image.pixels, image.layout
    picture = np.zeros((atlas.rows, atlas.cols, pixels.shape[2]), dtype=pixels.dtype)
    there = set(view_numbers(layout))
    for row, v in enumerate(atlas.vs):
        for col, u in enumerate(atlas.us):
            if (u, v) in there:
                down, across = row * atlas.view_rows, col * atlas.view_cols
                place = slice(down, down + atlas.view_rows), slice(across, across + atlas.view_cols)
                picture[place] = as_square(view(pixels, layout, u, v), layout)
    return picture


def _spread(count: int, most: int) -> tuple[int, ...]:
    if most == 1 or count == 1:
        return ((count - 1) // 2,)
    return tuple(int(place) for place in np.linspace(0, count - 1, min(count, most)).round())
