"""The region in which every lens shows an eye light of its own cell."""

from __future__ import annotations

from lippmann.errors import LayoutError
from lippmann.lattice.layout import CellLayout

ENDLESS_MM = 1e12
"""A distance at which an eye sees all lenses at one slope, to a millionth of a pixel, as it sees a view."""


def reach_mm(layout: CellLayout, distance_mm: float, *, pitch_mm: float, gap_mm: float) -> tuple[float, float]:
    """Return the largest distances of an eye from the axis, (to the side, up), mm.

    As far as the outermost lenses show it the middles of their outermost pixels, of a square as large as a lens is
    wide: endlessly far away, from the first view to the last.

    Parameters
    ----------
    layout
        Of the orthoscopic sheet.
    distance_mm
        Of the eye from the display.
    pitch_mm, gap_mm
        Of the lenses; reduced, between pixels and lenses.

    Raises
    ------
    LayoutError
        If the eye is so near that it nowhere sees all lenses.
    """
    slope = pitch_mm / (2 * gap_mm) * (layout.px_per_lens - 1) / layout.px_per_lens
    high_mm, wide_mm = (side / 2 for side in layout.lenses_of_pitch(pitch_mm).span)
    right_mm, up_mm = slope * distance_mm - wide_mm, slope * distance_mm - high_mm
    if min(right_mm, up_mm) < 0:
        least_mm = max(wide_mm, high_mm) / slope if slope else float("inf")
        raise LayoutError(
            f"expected an eye at least {least_mm:g} mm away, which sees light of all lenses, got {distance_mm:g} mm"
        )
    return right_mm, up_mm
