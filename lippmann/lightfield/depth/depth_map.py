"""Depth maps of a sheet: the depth of every pixel in the scene, on the display, and as disparity.

A depth map is a sheet `(rows, cols, 4)` in single precision, pixel for pixel with the integral image: it is cut into
cells, turned and taken apart into views by the same functions. NaN where a pixel shows no surface (sky) or has no ray
(dead corners of an array, apertures of the imaging lens).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import LayoutError
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.sheet.bands import HeldRows, OrthoscopicSheet, Sheet, SheetOfRows, stitched
from lippmann.lightfield.views.views import view

CHANNELS = ("z_mm", "s_mm", "disparity_u", "disparity_v")
"""The names of the channels, in an array and in a file."""


@dataclass(frozen=True)
class DepthMap:
    """The depth of a sheet, or of one of its views."""

    values: NDArray[np.float32]
    """`(row, col, 4)`, see `CHANNELS`."""

    def __post_init__(self) -> None:
        """Refuse an array of another number of channels."""
        if self.values.ndim != 3 or self.values.shape[2] != len(CHANNELS):
            raise LayoutError(f"expected depths (rows, cols, {len(CHANNELS)}), got an array of {self.values.shape}")

    @property
    def z_mm(self) -> NDArray[np.float32]:
        """Distance from surface 1 of the imaging lens, or from the origin of the rig, to the surface along z, mm."""
        return self.values[..., 0]

    @property
    def s_mm(self) -> NDArray[np.float32]:
        """The depth s at which a display with a gap of one focal length shows it, mm in front of the lens array."""
        return self.values[..., 1]

    @property
    def disparity_u(self) -> NDArray[np.float32]:
        """The lens pitches by which a point moves to the left when the eye moves to the next view on the right."""
        return self.values[..., 2]

    @property
    def disparity_v(self) -> NDArray[np.float32]:
        """The lens pitches by which a point moves up when the eye moves down to the next view."""
        return self.values[..., 3]

    def view(self, layout: CellLayout, u: int, v: int) -> DepthMap:
        """Return the depth of a view of a sheet, one pixel a lens.

        Parameters
        ----------
        layout
            The lenses over the sheet.
        u, v
            The view.

        Raises
        ------
        LayoutError
            If there is no such view, or this is no sheet of the layout.
        """
        return DepthMap(view(self.values, layout, u, v))


def turned_bands(
    captured: Sheet, *, inverted: bool, band_px: int, nothing: Sequence[float] = (np.nan,)
) -> Iterator[NDArray[np.float32]]:
    """Yield the rows of the depth, or of other numbers, of an orthoscopic integral image, top down, in bands.

    Parameters
    ----------
    captured
        The numbers of the capture, `(rows, cols, number)`; for those of depth see `CHANNELS`.
    inverted
        As in `orthoscopic`.
    band_px
        About so many pixels a band.
    nothing
        What stands where there is no lens, for each number or for all of them.
    """
    layout = captured.layout
    lit = SheetOfRows(HeldRows(np.broadcast_to(np.True_, (layout.rows, layout.cols, 1))), layout)
    upright, under_a_lens = (stitched(OrthoscopicSheet(each, inverted=inverted), band_px) for each in (captured, lit))
    for values, own in zip(upright, under_a_lens, strict=True):
        yield np.where(own, values, np.array(nothing, dtype=np.float32))
