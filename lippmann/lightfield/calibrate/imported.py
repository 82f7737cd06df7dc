"""Convert a picture from elsewhere to a sheet of whole cells, upright and orthoscopic."""

from __future__ import annotations

from numpy.typing import NDArray

from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.sheet.interpolation import Light
from lippmann.lightfield.sheet.lens_grid import LensGrid
from lippmann.lightfield.sheet.orthoscopic import half_turn_cells, orthoscopic, turn_sheet
from lippmann.lightfield.sheet.rectify import rectify


def orthoscopic_of(
    picture: NDArray[Light], grid: LensGrid, layout: CellLayout, *, pseudoscopic: bool, inverted: bool
) -> NDArray[Light]:
    """Return the orthoscopic sheet of a picture from elsewhere.

    Parameters
    ----------
    picture
        `(rows, cols, channel)`, linear light.
    grid
        Where its lenses are.
    layout
        Of its whole cells before anything is turned.
    pseudoscopic
        Whether its depth is inside out.
    inverted
        Whether its picture is upside down.

    Returns
    -------
    NDArray
        As `orthoscopic`; its layout is `orthoscopic_layout(layout, inverted=inverted)`.
    """
    sheet = rectify(picture, grid, layout)
    if pseudoscopic:
        return orthoscopic(sheet, layout, inverted=inverted)
    return turn_sheet(sheet) if inverted else sheet


def captured_of(
    picture: NDArray[Light], grid: LensGrid, layout: CellLayout, *, pseudoscopic: bool, inverted: bool
) -> NDArray[Light]:
    """Return the upright pseudoscopic sheet, as direct pickup would have captured it.

    Parameters
    ----------
    picture, grid, layout, pseudoscopic, inverted
        As in `orthoscopic_of`.

    Returns
    -------
    NDArray
        `(rows, cols, channel)`, in the dtype of the picture.
    """
    shown = orthoscopic_of(picture, grid, layout, pseudoscopic=pseudoscopic, inverted=inverted)
    return half_turn_cells(shown, layout.turned() if inverted else layout)
