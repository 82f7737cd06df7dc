"""The depth of one view on square pixels, known or estimated."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.depth.depth_map import DepthMap
from lippmann.lightfield.depth.plane_sweep import REACH, plane_sweep, sweep_depths
from lippmann.lightfield.depth.structure_tensor import structure_tensor
from lippmann.lightfield.image import IntegralImage
from lippmann.lightfield.views.square_pixels import nearest_as_square

Method = Literal["tensor", "sweep"]

RANGE = 2.0
"""The default range of the estimate: the disparity to either side of the display, pitches a view."""

TENSOR_STEP = 0.5
"""The step of the disparity from one evaluation of the structure tensor to the next, pitches a view."""

Map = NDArray[np.float32]


@dataclass(frozen=True)
class ViewDepth:
    """The depth of a view; all maps are `(row, col)`, NaN where the depth is unknown."""

    s_mm: Map
    """The depth s, mm in front of the display."""
    disparity: Map
    """s / (n f): pitches a view, positive in front."""
    other: Map
    """True: `z_mm`, in the scene. Estimated: the confidence, 0 to 1."""
    source: Literal["truth", "estimate"]

    @property
    def channels(self) -> tuple[str, str, str]:
        """The names of the three maps in a file."""
        return "s_mm", "disparity", "z_mm" if self.source == "truth" else "confidence"


def true_depth(depth: DepthMap, layout: CellLayout, number: tuple[int, int], *, focal_mm: float) -> ViewDepth:
    """Return the true depth of a view: that of the nearest lens, so that no two depths are mixed.

    Parameters
    ----------
    depth
        The depth of an orthoscopic sheet.
    layout
        The lenses over the sheet.
    number
        The view, (u, v).
    focal_mm
        The focal length of the lenses, mm.

    Raises
    ------
    LayoutError
        If there is no such view, or the depth is not of this layout.
    """
    values = nearest_as_square(depth.view(layout, *number).values, layout)
    return _view_depth(values[..., 1], values[..., 0], "truth", layout, focal_mm)


def estimated_depth(
    image: IntegralImage,
    number: tuple[int, int],
    *,
    method: Method = "tensor",
    range_mm: tuple[float, float] | None = None,
    reach: int = REACH,
) -> ViewDepth:
    """Estimate the depth of a view; NaN where the views contain no depth, as in a uniform colour.

    Parameters
    ----------
    image, number, reach
        As in `plane_sweep`.
    method
        `tensor`: `structure_tensor`; `sweep`: `plane_sweep`.
    range_mm
        The farthest and the nearest depth s that is searched, mm in front of the display; None for `RANGE`.

    Raises
    ------
    LayoutError
        As in the methods.
    """
    layout, focal_mm = image.layout, image.focal_length_mm
    step_mm = layout.px_per_lens * focal_mm
    farthest_mm, nearest_mm = range_mm or (-RANGE * step_mm, RANGE * step_mm)
    if method == "sweep":
        depths = sweep_depths(layout, nearest_mm, farthest_mm, focal_mm=focal_mm, reach=reach)
        found = plane_sweep(image, number, depths, reach=reach)
    else:
        count = max(1, round((nearest_mm - farthest_mm) / (TENSOR_STEP * step_mm)))
        depths = tuple(float(depth) for depth in np.linspace(farthest_mm, nearest_mm, count + 1))
        found = structure_tensor(image, number, depths, reach=reach)
    told = np.where(found.confidence > 0, found.s_mm, np.nan).astype(np.float32)
    return _view_depth(told, found.confidence, "estimate", layout, focal_mm)


def _view_depth(
    s_mm: Map, other: Map, source: Literal["truth", "estimate"], layout: CellLayout, focal_mm: float
) -> ViewDepth:
    disparity = (s_mm / (layout.px_per_lens * focal_mm)).astype(np.float32)
    return ViewDepth(s_mm=s_mm, disparity=disparity, other=other, source=source)
