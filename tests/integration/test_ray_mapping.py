"""The oracle: the modelled glass against the exact trace, two independent ways to the same numbers.

A plane whose colour codes the position that was hit (16 bits a coordinate) is rendered through array and imaging lens,
in tiles; the decoded points are compared with those of the NumPy trace, pixel by pixel. Half floats are too coarse for
it, so the pictures are 16-bit PNGs.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.builders import local_place, rendered_codes, small_job, stored_job, tiles_of
from worker.integral.assemble import assemble
from worker.job.spec import JobSpec
from worker.optics.capture import bench, object_rays, pixel_centres_mm
from worker.plan.sampling import frame_size

HALF_WIDTH_MM = 400.0
"""The target codes x and y from -400 to 400 mm: a quantum is 0.012 mm."""

MEDIAN_MM = 0.02
LARGEST_MM = 0.1


def traced_mm(spec: JobSpec, *, distance_mm: float) -> NDArray[np.float64]:
    """Return where each pixel's ray meets the target, `(row, col, 2)`; NaN where an aperture stops it."""
    stood = bench(spec.rig, reference_mm=1000.0)
    return object_rays(stood, pixel_centres_mm(stood)).at_z(-distance_mm)[..., :2]


def rendered_mm(folder: Path, spec: JobSpec) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Return where POV-Ray's rays met the target, `(row, col, 2)`, and which did."""
    place = local_place(folder)
    sheet = stored_job(place, spec)
    tiles = [
        (tile, rendered_codes(place, sheet, tile=tile)[tile.row_start : tile.row_stop, tile.col_start : tile.col_stop])
        for tile in tiles_of(spec)
    ]
    codes = assemble(frame_size(spec.rig), tiles)
    return codes[..., :2] / 65535 * 2 * HALF_WIDTH_MM - HALF_WIDTH_MM, codes[..., 2] > 32768


@pytest.mark.parametrize("distance_mm", [1000.0, 2500.0])
@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
@pytest.mark.parametrize("aperture", ["full", "inscribed"])
def test_glass_maps_every_pixel_where_the_exact_trace_does(
    tmp_path: Path, projection: str, aperture: str, distance_mm: float
) -> None:
    spec = small_job(
        "target-position",
        parameters={"distance_mm": distance_mm, "half_width_mm": HALF_WIDTH_MM},
        camera={"projection": projection},
        lens_array={"aperture": aperture},
        tiles=[2, 2],
    )
    found_mm, hit = rendered_mm(tmp_path, spec)
    expected_mm = traced_mm(spec, distance_mm=distance_mm)
    assert (hit == ~np.isnan(expected_mm[..., 0])).all()
    error_mm = np.hypot(*np.moveaxis(found_mm - expected_mm, -1, 0))
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
