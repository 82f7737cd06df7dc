"""The integral image: pixels, the lenses over them, and the millimetres that turn pixels into depths.

A capture is pseudoscopic: its depth is inverted, so nothing but the conversion to an orthoscopic image is computed from
it. The functions of `views`, `refocus`, `depth` and `observer` take an orthoscopic image and refuse a pseudoscopic one.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import LayoutError
from lippmann.lattice.layout import CellLayout, check_sheet
from lippmann.lightfield.depth.depth_map import DepthMap
from lippmann.lightfield.observer.display import LensDisplay
from lippmann.lightfield.sheet.orthoscopic import orthoscopic, orthoscopic_layout


@dataclass(frozen=True, eq=False, kw_only=True)
class IntegralImage:
    """An integral image and the lens array that shows it.

    Parameters
    ----------
    pixels
        `(rows, cols, channel)`, floating, linear light; three channels are red, green and blue.
    layout
        The lattice of lenses over the pixels.
    pitch_mm
        Distance between the centres of neighbouring lenses, mm.
    focal_length_mm
        Focal length of the lenses, mm; it is also the gap between the pixels and the lenses of a display.
    pseudoscopic
        True for an image as captured, whose depth is inverted.
    inverted
        True for a pseudoscopic image whose picture an imaging lens turned upside down.
    depth_map
        The known depth of every pixel, if there is one.
    display
        The display on which `observe` shows the image; None is a display whose gap is one focal length.

    Raises
    ------
    LayoutError
        If the pixels do not fit the layout, are not floating, or a length is not positive.
    """

    pixels: NDArray[np.floating[Any]] = field(repr=False)
    layout: CellLayout
    pitch_mm: float
    focal_length_mm: float
    pseudoscopic: bool = False
    inverted: bool = False
    depth_map: DepthMap | None = field(default=None, repr=False)
    display: LensDisplay | None = None

    def __post_init__(self) -> None:
        """Refuse pixels that do not fit, and lengths that are not positive."""
        check_sheet(self.pixels, self.layout)
        if not np.issubdtype(self.pixels.dtype, np.floating):
            raise LayoutError(f"expected pixels of linear light as floating numbers, got {self.pixels.dtype}")
        if self.depth_map is not None:
            check_sheet(self.depth_map.values, self.layout)
        if self.inverted and not self.pseudoscopic:
            raise LayoutError("expected inverted only of a pseudoscopic image, got it of an orthoscopic one")
        for name, length_mm in (("pitch", self.pitch_mm), ("focal length", self.focal_length_mm)):
            if not 0 < length_mm < math.inf:
                raise LayoutError(f"expected a positive {name} in mm, got {length_mm:g}")

    def __str__(self) -> str:
        kind = "pseudoscopic" if self.pseudoscopic else "orthoscopic"
        return f"{kind} integral image, {self.layout}, pitch {self.pitch_mm:g} mm, f {self.focal_length_mm:g} mm"

    def check_orthoscopic(self) -> None:
        """Refuse a pseudoscopic image.

        Raises
        ------
        LayoutError
            If the image is pseudoscopic.
        """
        if self.pseudoscopic:
            raise LayoutError("expected an orthoscopic integral image, got a pseudoscopic one: convert it first")

    def orthoscopic(self) -> Self:
        """Convert a pseudoscopic image; an orthoscopic one is returned as it is.

        Returns
        -------
        IntegralImage
            The orthoscopic image, and its depth map where there is one.
        """
        if not self.pseudoscopic:
            return self
        depth = self.depth_map
        upright = None if depth is None else DepthMap(orthoscopic(depth.values, self.layout, inverted=self.inverted))
        return replace(
            self,
            pixels=orthoscopic(self.pixels, self.layout, inverted=self.inverted),
            layout=orthoscopic_layout(self.layout, inverted=self.inverted),
            pseudoscopic=False,
            inverted=False,
            depth_map=upright,
        )

    def shown_on(self) -> LensDisplay:
        """Return the display that shows the image: its own, or one whose gap is one focal length."""
        return self.display or LensDisplay(
            layout=self.layout, pitch_mm=self.pitch_mm, focal_mm=self.focal_length_mm, gap_mm=self.focal_length_mm
        )
