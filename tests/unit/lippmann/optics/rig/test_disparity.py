"""How far a point moves from view to view: against the rays of whole cells, and the paraxial formula."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from lippmann.job.optics.rig import Rig
from lippmann.optics.rig.bench import Bench, bench, object_rays
from lippmann.optics.rig.disparity import exact_disparity, small_angle_disparity


def bench_of(**rig: Any) -> Bench:
    return bench(Rig.model_validate(rig), reference_mm=1000.0)


def measured(here: Bench, object_mm: float) -> float:
    """Return the disparity that the rays of real pixels give: of each pixel column, where the axis is seen."""
    n, (_, lenses) = here.rig.px_per_lens, here.rig.lens_array.count
    pitch_mm = here.rig.lens_array.pitch_mm
    lens_x = np.arange(lenses) - (lenses - 1) / 2
    pixel = np.arange(n)
    x_mm = (lens_x[:, np.newaxis] + (pixel + 0.5 - n / 2) / n) * pitch_mm
    seen = object_rays(here, np.stack((x_mm, np.zeros_like(x_mm)), axis=-1)).at_z(-object_mm)[..., 0]
    whole = np.isfinite(seen).all(axis=1)
    places = []
    for column in pixel:
        order = np.argsort(seen[whole, column])
        places.append(np.interp(0.0, seen[whole, column][order], lens_x[whole][order]))
    return -float(np.polyfit(pixel, places, 1)[0])  # views count from the right


@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
@pytest.mark.parametrize("object_mm", [1000.0, 1250.0, 1750.0, 2500.0])
def test_the_exact_disparity_is_that_of_the_rays_of_real_cells(object_mm: float, projection: str) -> None:
    # An odd count: a lens on the axis, and rows of lenses through it.
    here = bench_of(lens_array={"count": [41, 41]}, camera={"projection": projection})
    assert exact_disparity(here, object_mm) == pytest.approx(measured(here, object_mm), abs=2e-3)


@pytest.mark.parametrize("offset_mm", [-60.0, -20.0, -5.0])
def test_in_direct_pickup_with_slow_lenses_small_angles_are_exact(offset_mm: float) -> None:
    slow = {"focal_length_mm": 33.0, "offset_mm": offset_mm}
    here = bench_of(imaging_lens=None, lens_array=slow)
    assert exact_disparity(here, 1000.0) == pytest.approx(small_angle_disparity(here, 1000.0), rel=2e-3, abs=2e-4)


def test_small_angles_give_the_shift_of_the_paper_s_array() -> None:
    here = bench_of(lens_array={"offset_mm": 40.0}, px_per_lens=8)
    # 40 / (8 x 3.3) = 1.515 of the image, and 1 / 8 because the pinholes stand a focal length before the array.
    assert small_angle_disparity(here, 1000.0) == pytest.approx(1.515 + 1 / 8, abs=5e-4)


def test_more_pixels_a_lens_than_are_traced_change_nothing_but_the_step() -> None:
    few, many = (exact_disparity(bench_of(px_per_lens=n, lens_array={"count": [30, 30]}), 1000.0) for n in (30, 300))
    assert few is not None
    assert many is not None
    assert many * 300 == pytest.approx(few * 30, rel=1e-2)
