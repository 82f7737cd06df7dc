"""The exact trace on the arrays of the engine is that on the arrays of NumPy."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from lippmann.job.optics.rig import Rig
from lippmann.optics.rig.bench import bench, object_ray, pixel_centres_mm
from lippmann.optics.rig.pixel_rays import pixel_rays

ASPHERE = {
    "surfaces": [
        {"radius_mm": 60.0, "thickness_mm": 12.0, "material": "BK7", "semi_aperture_mm": 24.0, "conic": -0.6,
         "aspheric": [1e-7, -2e-11]},
        {"radius_mm": -90.0, "index": 1.0, "semi_aperture_mm": 24.0},
    ],
}  # fmt: skip
RIGS: dict[str, dict[str, Any]] = {
    "square": {},
    "hexagonal": {"lens_array": {"lattice": "hexagonal"}},
    "inscribed": {"lens_array": {"aperture": "inscribed"}},
    "perspective": {"camera": {"projection": "perspective"}},
    "direct": {"imaging_lens": None, "lens_array": {"offset_mm": -10}},
    "stopped": {"f_number": 8},
    "asphere": {"imaging_lens": ASPHERE},
}


@pytest.mark.parametrize("name", RIGS)
def test_the_rays_of_the_engine_are_those_of_numpy(mi: Any, name: str) -> None:
    from worker.engines.mitsuba.inside.arrays import DrJitArrays

    rig = Rig.model_validate({**RIGS[name], "px_per_lens": 6})
    optical_bench = bench(rig, reference_mm=1000.0)
    expected = pixel_rays(optical_bench, rows=rig.layout.rows, cols=rig.layout.cols)
    points = pixel_centres_mm(optical_bench)
    ray = object_ray(
        optical_bench, mi.Float64(points[..., 0].ravel()), mi.Float64(points[..., 1].ravel()), xp=DrJitArrays()
    )
    dead = np.isnan(expected.direction).any(axis=-1).mean()
    assert (0 < dead < 1) == (name in ("stopped", "asphere", "perspective"))
    for found, wanted in ((ray.position, expected.position), (ray.direction, expected.direction)):
        values = np.stack(
            [np.broadcast_to(np.array(part), points.shape[0] * points.shape[1]) for part in found], axis=-1
        )
        assert values.dtype == np.float64
        assert np.allclose(values.reshape(wanted.shape), wanted, rtol=0, atol=1e-10, equal_nan=True)
