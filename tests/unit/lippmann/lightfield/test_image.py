"""The integral image refuses what it cannot be, and a pseudoscopic one passes for no orthoscopic one."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from lippmann.errors import LayoutError
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.depth.depth_map import DepthMap
from lippmann.lightfield.depth.plane_sweep import plane_sweep
from lippmann.lightfield.depth.structure_tensor import structure_tensor
from lippmann.lightfield.depth.view_depth import estimated_depth
from lippmann.lightfield.image import IntegralImage
from lippmann.lightfield.refocus.ciir import ciir_stack
from lippmann.lightfield.refocus.depth_focused_view import depth_focused_view
from lippmann.lightfield.refocus.shift_and_sum import focal_stack
from lippmann.lightfield.views.atlas import atlas_picture, plan_atlas
from lippmann.lightfield.views.epi import epi_of_col, epi_of_row
from lippmann.lightfield.views.interpolate import spread_views
from lippmann.lightfield.views.light_field import light_field
from lippmann.lightfield.views.perspective import Eye, perspective
from tests.unit.lippmann.lightfield.sheets import image_of

LAYOUT = CellLayout(9, 9, 6)
PIXELS = np.random.default_rng(1).random((54, 54, 3))

USES: tuple[Callable[[IntegralImage], Any], ...] = (
    lambda image: focal_stack(image, (1.0,)),
    lambda image: ciir_stack(image, (1.0,)),
    lambda image: depth_focused_view(image, 8.0),
    lambda image: plane_sweep(image, (3, 3), (0.0, 1.0, 2.0)),
    lambda image: structure_tensor(image, (3, 3), (0.0,)),
    lambda image: estimated_depth(image, (3, 3)),
    lambda image: atlas_picture(image, plan_atlas(LAYOUT, max_px=54)),
    lambda image: epi_of_row(image, 2),
    lambda image: epi_of_col(image, 2),
    lambda image: list(spread_views(image, 3, 4)),
    lambda image: light_field(image),
    lambda image: perspective(image, Eye(0, 0, 300)),
)


@pytest.mark.parametrize("use", USES, ids=lambda use: inspect.getsource(use).partition("image: ")[2].partition("(")[0])
def test_a_pseudoscopic_image_is_refused(use: Callable[[IntegralImage], Any]) -> None:
    image = image_of(PIXELS, LAYOUT)
    use(image)
    with pytest.raises(LayoutError, match="expected an orthoscopic integral image, got a pseudoscopic one"):
        use(replace(image, pseudoscopic=True))


@pytest.mark.parametrize("length_mm", [0.0, -1.0, math.inf, math.nan])
def test_pitch_and_focal_length_are_positive(length_mm: float) -> None:
    for name in ("pitch", "focal length"):
        lengths = {f"{name.replace(' ', '_')}_mm": length_mm}
        with pytest.raises(LayoutError, match=f"expected a positive {name} in mm"):
            image_of(PIXELS, LAYOUT, **lengths)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"pixels": PIXELS[:-1]}, "54 x 53 px do not divide among 9 x 9 lenses of 6 px"),
        ({"pixels": PIXELS[..., 0]}, "expected a sheet"),
        ({"pixels": PIXELS.astype(np.uint8)}, "expected pixels of linear light as floating numbers, got uint8"),
        ({"depth_map": DepthMap(np.zeros((6, 6, 4), np.float32))}, "6 x 6 px do not divide"),
        ({"inverted": True}, "expected inverted only of a pseudoscopic image"),
    ],
)
def test_what_does_not_fit_together_is_refused(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(LayoutError) as refused:
        replace(image_of(PIXELS, LAYOUT), **changes)
    assert message in refused.value.message
