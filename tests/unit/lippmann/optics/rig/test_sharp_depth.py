"""The depth at which a refocused picture is sharpest: against the best focus of the lens, and whole sheets."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from lippmann.job.optics.rig import Rig
from lippmann.lightfield.sheet.orthoscopic import orthoscopic
from lippmann.lightfield.views.views import view, view_numbers
from lippmann.optics.rig import array as lattice
from lippmann.optics.rig.bench import bench, pixel_centres_mm
from lippmann.optics.rig.sharp_depth import MAX_VIEWS, sharp_depth_mm, view_offset_mm, view_offsets_mm
from lippmann.optics.rig.spots import best_focus
from lippmann.plan.sampling import display_size, frame_size


def rig_of(**changes: Any) -> Rig:
    return Rig.model_validate(changes)


def on_axis_mm(rig: Rig, object_mm: float) -> float:
    here = bench(rig, reference_mm=1000.0)
    return float(sharp_depth_mm(here, np.array([0.0, 0.0, -object_mm]), view_offsets_mm(rig, display_size(rig))))


@pytest.mark.parametrize("object_mm", [1000.0, 1750.0])
def test_on_the_axis_it_is_the_best_focus_of_the_imaging_lens_a_focal_length_nearer(object_mm: float) -> None:
    # Many views fill the cone that the smallest spot is computed of.
    rig = rig_of(px_per_lens=40, lens_array={"count": [20, 20]})
    here = bench(rig, reference_mm=1000.0)
    found = best_focus(bench(rig_of(lens_array={"count": [90, 90]}), reference_mm=1000.0), object_mm)
    assert found is not None
    spot_mm = found.image_mm - here.mla_behind_lens_mm + rig.lens_array.focal_length_mm
    # The spot knows no aberration of the microlenses, which is 5 % at the rim.
    assert on_axis_mm(rig, object_mm) == pytest.approx(spot_mm, abs=1.5)
    assert here.s_mm(object_mm) + 3.3 - spot_mm > 6  # what the paraxial depth is off


@pytest.mark.parametrize("offset_mm", [-60.0, -5.0])
def test_in_direct_pickup_with_slow_lenses_it_is_the_paraxial_depth(offset_mm: float) -> None:
    rig = rig_of(imaging_lens=None, lens_array={"focal_length_mm": 33.0, "offset_mm": offset_mm})
    assert on_axis_mm(rig, 1000.0) == pytest.approx(offset_mm + 33.0, abs=0.1)


@pytest.mark.parametrize("lattice_name", ["square", "hexagonal"])
@pytest.mark.parametrize("pickup", [False, True], ids=["imaging lens", "direct pickup"])
def test_a_view_is_recorded_where_the_conversion_takes_its_pixels_from(lattice_name: str, pickup: bool) -> None:
    changes: dict[str, Any] = {"imaging_lens": None} if pickup else {}
    rig = rig_of(px_per_lens=8, lens_array={"count": [6, 6], "lattice": lattice_name, "offset_mm": 0.0}, **changes)
    here, layout = bench(rig, reference_mm=1000.0), display_size(rig)
    places = orthoscopic(pixel_centres_mm(here), frame_size(rig), inverted=not pickup)
    for u, v in view_numbers(layout):
        seen = view(places, layout, u, v)
        from_axis = seen - lattice.nearest_centre_mm(rig.lens_array, seen)
        np.testing.assert_allclose(from_axis, np.broadcast_to(view_offset_mm(rig, layout, u, v), seen.shape), atol=1e-9)


def test_of_many_views_an_even_choice_is_traced() -> None:
    rig = rig_of(px_per_lens=24, lens_array={"count": [10, 10]})
    offsets = view_offsets_mm(rig, display_size(rig))
    assert len(offsets) == MAX_VIEWS**2
    np.testing.assert_allclose(offsets.mean(axis=0), 0, atol=1e-9)


def test_a_point_that_no_ray_comes_from_has_no_depth() -> None:
    rig = rig_of()
    here = bench(rig, reference_mm=1000.0)
    far_aside = np.array([1e5, 0.0, -1000.0])
    assert np.isnan(sharp_depth_mm(here, far_aside, view_offsets_mm(rig, display_size(rig))))
