"""The oracle: the modelled glass against the exact trace, two independent ways to the same numbers.

A plane whose colour codes the position that was hit (16 bits a coordinate) is rendered through array and imaging lens,
in tiles; the decoded points are compared with those of the NumPy trace, pixel by pixel. Half floats are too coarse for
it, so the pictures are 16-bit PNGs.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from lippmann.job.spec import JobSpec
from lippmann.lightfield.sheet.assemble import assembled
from lippmann.optics.rig.bench import bench, object_rays, pixel_centres_mm
from lippmann.plan.sampling import frame_size
from tests.builders import local_place, rendered_codes, small_job, stored_job, tiles_of

HALF_WIDTH_MM = 400.0
"""The target codes x and y from -400 to 400 mm: a quantum is 0.012 mm."""

MEDIAN_MM = 0.02
LARGEST_MM = 0.1

LEAST_SEEN = 0.25
"""Of the pixels: stops and dead corners leave the rest dark, and black pixels prove little."""

DOUBLE_GAUSS = {"name": "double-gauss-tronnier", "focal_length_mm": 300}


def traced_mm(spec: JobSpec, *, distance_mm: float) -> NDArray[np.float64]:
    """Return where each pixel's ray meets the target, `(row, col, 2)`; NaN where an aperture stops it."""
    optical_bench = bench(spec.rig, reference_mm=1000.0)
    return object_rays(optical_bench, pixel_centres_mm(optical_bench)).at_z(-distance_mm)[..., :2]


def rendered_mm(folder: Path, spec: JobSpec) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Return where POV-Ray's rays met the target, `(row, col, 2)`, and which did."""
    place = local_place(folder)
    sheet = stored_job(place, spec)
    tiles = [(tile, rendered_codes(place, sheet, tile=tile)) for tile in tiles_of(spec)]
    codes = np.concatenate(list(assembled(frame_size(spec.rig), tiles)))
    return codes[..., :2] / 65535 * 2 * HALF_WIDTH_MM - HALF_WIDTH_MM, codes[..., 2] > 32768


ASPHERE: dict[str, Any] = {
    # The conic sharpens the picture on the axis, the fourth-order term bends it away again: nothing a sphere can do.
    "surfaces": [
        {"radius_mm": 250, "thickness_mm": 30, "index": 1.5, "semi_aperture_mm": 90, "conic": -0.6, "aspheric": [2e-9]},
        {"radius_mm": -400, "index": 1, "semi_aperture_mm": 90},
    ]
}
BENCHES: dict[str, dict[str, Any]] = {
    "square": {},
    "square, perspective": {"camera": {"projection": "perspective"}},
    "square, inscribed": {"lens_array": {"aperture": "inscribed"}},
    "square, inscribed, perspective": {
        "lens_array": {"aperture": "inscribed"},
        "camera": {"projection": "perspective"},
    },
    "hexagonal": {"lens_array": {"lattice": "hexagonal"}},
    "hexagonal, perspective": {"lens_array": {"lattice": "hexagonal"}, "camera": {"projection": "perspective"}},
    "hexagonal, inscribed": {"lens_array": {"lattice": "hexagonal", "aperture": "inscribed"}},
    "hexagonal, odd lens rows": {"lens_array": {"lattice": "hexagonal"}, "count": (27, 30)},
    "the paper's lens stopped down": {"rig": {"f_number": 4.0}},
    "double Gauss with a stop": {"rig": {"imaging_lens": DOUBLE_GAUSS, "f_number": 2.8}},
    "direct pickup": {"rig": {"imaging_lens": None}, "lens_array": {"offset_mm": -200.0}},
    "square, by the ray camera": {"capture": {"method": "ray_camera"}},
    "hexagonal, inscribed, by the ray camera": {
        "lens_array": {"lattice": "hexagonal", "aperture": "inscribed"},
        "capture": {"method": "ray_camera"},
    },
    "an asphere, by the ray camera": {"rig": {"imaging_lens": ASPHERE}, "capture": {"method": "ray_camera"}},
    "direct pickup, by the ray camera": {
        "rig": {"imaging_lens": None},
        "lens_array": {"offset_mm": -200.0},
        "capture": {"method": "ray_camera"},
    },
}


@pytest.mark.parametrize("distance_mm", [1000.0, 2500.0])
@pytest.mark.parametrize("changes", BENCHES.values(), ids=BENCHES.keys())
def test_glass_maps_every_pixel_where_the_exact_trace_does(
    tmp_path: Path, changes: dict[str, Any], distance_mm: float
) -> None:
    parameters = {"distance_mm": distance_mm, "half_width_mm": HALF_WIDTH_MM}
    glass = {"capture": {"method": "glass"}}
    spec = small_job("target-position", parameters=parameters, tiles=[2, 2], **glass | changes)
    found_mm, hit = rendered_mm(tmp_path, spec)
    expected_mm = traced_mm(spec, distance_mm=distance_mm)
    seen = (np.abs(expected_mm) < HALF_WIDTH_MM).all(axis=-1)
    assert seen.mean() > LEAST_SEEN
    assert (hit == seen).all()
    error_mm = np.hypot(*np.moveaxis(found_mm - expected_mm, -1, 0))[seen]
    assert np.median(error_mm) <= MEDIAN_MM
    assert error_mm.max() <= LARGEST_MM


def test_the_oracle_sees_a_shift_by_one_row(tmp_path: Path) -> None:
    spec = small_job("target-position", parameters={"half_width_mm": HALF_WIDTH_MM}, count=(6, 6))
    found_mm, _ = rendered_mm(tmp_path, spec)
    expected_mm = traced_mm(spec, distance_mm=1000.0)
    for shift in (-1, 1):
        error_mm = np.hypot(*np.moveaxis(np.roll(found_mm, shift, axis=0) - expected_mm, -1, 0))
        assert np.median(error_mm) > 10 * LARGEST_MM


def test_the_whole_array_of_the_paper_is_inside_the_imaging_lens(tmp_path: Path) -> None:
    """With 90 x 90 lenses, and at the corners: no ray of the orthographic camera is lost."""
    spec = small_job("target-position", parameters={"half_width_mm": HALF_WIDTH_MM}, count=(90, 90), px_per_lens=2)
    found_mm, hit = rendered_mm(tmp_path, spec)
    assert hit.all()
    error_mm = np.hypot(*np.moveaxis(found_mm - traced_mm(spec, distance_mm=1000.0), -1, 0))
    assert error_mm.max() <= LARGEST_MM
