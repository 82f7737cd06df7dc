"""The spots of distant points."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from lippmann.errors import OpticsError
from lippmann.job.optics.rig import Rig
from lippmann.optics.lens.field_spots import field_spots
from lippmann.optics.lens.matrices import cardinal_points
from lippmann.optics.lens.published import IMAGING_LENSES
from lippmann.optics.lens.stop import with_stop
from lippmann.optics.lens.surfaces import ImagingLens, Surface
from lippmann.optics.lens.trace import Rays, through_lens


def test_a_paraboloid_mirror_like_surface_focuses_the_axis_into_a_point() -> None:
    # A plano-convex lens whose curved side is an ellipsoid of eccentricity 1 / n, light from the curved side, would
    # focus inside the glass; its mirror image, a hyperboloid of eccentricity n behind a plane, focuses in air.
    index = 1.5
    lens = ImagingLens(
        name="", title="", source="",
        surfaces=(
            Surface(radius_mm=math.inf, thickness_mm=10.0, index_after=index, semi_aperture_mm=15.0),
            Surface(radius_mm=-50.0, thickness_mm=0.0, index_after=1.0, semi_aperture_mm=15.0, conic=-(index**2)),
        ),
    )  # fmt: skip
    spots = field_spots(lens)
    assert spots.image_mm == pytest.approx(50.0 / (index - 1), abs=1e-6)
    assert spots.rms_mm[0] == pytest.approx(0.0, abs=1e-9)
    assert spots.rms_mm[1] is not None
    assert spots.rms_mm[1] > 0.01


@pytest.mark.parametrize("name", IMAGING_LENSES)
def test_the_best_plane_has_the_smallest_spot_on_the_axis(name: str) -> None:
    lens = IMAGING_LENSES[name]
    spots = field_spots(lens, (0.0,))
    on_axis = spots.rms_mm[0]
    assert on_axis is not None
    # The same bundle with fewer rays, over the disc of surface 1 and drawn from another grid.
    radius_mm = lens.surfaces[0].semi_aperture_mm
    x, y = np.meshgrid(*2 * [np.linspace(-radius_mm, radius_mm, 177)])
    starts = np.stack((x.ravel(), y.ravel(), np.full(x.size, -100.0)), axis=-1)
    rays = through_lens(Rays(starts, np.broadcast_to([0.0, 0.0, 1.0], starts.shape)), lens)

    def rms_mm(shift_mm: float) -> float:
        points = rays.at_z(lens.length_mm + spots.image_mm + shift_mm)[:, :2]
        points = points[np.isfinite(points).all(axis=1)]
        return float(np.sqrt(((points - points.mean(axis=0)) ** 2).sum(axis=1).mean()))

    assert rms_mm(0.0) == pytest.approx(on_axis, rel=0.02)
    step_mm = cardinal_points(lens).effective_focal_length_mm / 100
    assert rms_mm(0.0) < min(rms_mm(-step_mm), rms_mm(step_mm))


def test_spots_scale_with_the_lens_and_shrink_as_it_is_stopped_down() -> None:
    lens = IMAGING_LENSES["athineos-2006"]
    whole, half = field_spots(lens), field_spots(lens.scaled(0.5))
    stopped = field_spots(with_stop(lens, Rig(f_number=8)))
    for at_full, at_half, at_f8 in zip(whole.rms_mm, half.rms_mm, stopped.rms_mm, strict=True):
        assert at_full is not None
        assert at_half is not None
        assert at_f8 is not None
        assert at_half == pytest.approx(at_full / 2, rel=1e-6)
        assert at_f8 < at_full / 2


def test_the_spot_of_the_papers_lens_on_the_axis_at_full_aperture_is_3_mm() -> None:
    assert field_spots(IMAGING_LENSES["athineos-2006"]).rms_mm[0] == pytest.approx(3.0, abs=0.02)


def test_a_direction_from_which_no_light_passes_has_no_spot() -> None:
    assert field_spots(IMAGING_LENSES["cooke-triplet"], (0.0, 80.0)).rms_mm[1] is None


def test_a_plate_without_power_is_refused() -> None:
    lens = IMAGING_LENSES["cooke-triplet"]
    plate = replace(lens, surfaces=tuple(replace(one, radius_mm=math.inf) for one in lens.surfaces))
    with pytest.raises(OpticsError, match="expected a lens with power"):
        field_spots(plate)
