"""Where a display shows the scene in depth, against the designer's numbers and the refocus they are for."""

from __future__ import annotations

import numpy as np
import pytest

from lippmann.errors import LayoutError
from lippmann.job.optics.rig import Rig
from lippmann.job.scenes.stage import Stage
from lippmann.lightfield.refocus.shift_and_sum import checked_shifts
from lippmann.plan.design.depths import shown_depths
from lippmann.plan.sampling import display_size

FISH = Stage(location=(0, 0, 0), look_at=(0, 0, 1), near_mm=538.0, reference_mm=560.0, far_mm=700.0)
FAR_OFF = Stage(location=(0, 0, 0), look_at=(0, 0, 1), near_mm=538.0, reference_mm=700.0, far_mm=1e9)


@pytest.mark.parametrize("lattice", ["square", "hexagonal"])
def test_a_range_holds_the_scene_and_the_display_and_can_be_focused_through(lattice: str) -> None:
    rig = Rig.model_validate({"lens_array": {"lattice": lattice}})
    found, layout = shown_depths(rig, FISH), display_size(rig)
    assert found.near_mm is not None
    assert found.far_mm is not None
    assert found.from_mm < min(0.0, found.far_mm)
    assert found.to_mm > max(0.0, found.near_mm)
    for depth_mm in (found.from_mm, found.near_mm, found.to_mm):
        down, across = checked_shifts(layout, depth_mm, focal_mm=rig.lens_array.focal_length_mm)
        np.testing.assert_allclose((across, down), depth_mm * np.array(found.lenses_per_mm))


def test_the_reference_plane_is_shown_where_its_picture_is_sharp_and_not_at_its_paraxial_depth() -> None:
    stage = FISH.model_copy(update={"near_mm": 1000.0, "reference_mm": 1000.0, "far_mm": 2500.0})
    # The paraxial depth is the offset of 40 mm and one focal length; the spherical aberration takes 6 mm of it.
    assert shown_depths(Rig(), stage).reference_mm == pytest.approx(37.28, abs=0.01)


def test_without_aberration_the_reference_plane_is_the_offset_and_a_focal_length_before_the_display() -> None:
    rig = Rig.model_validate({"imaging_lens": None, "lens_array": {"focal_length_mm": 33.0, "offset_mm": 25.0}})
    assert shown_depths(rig, FISH).reference_mm == pytest.approx(25.0 + 33.0, abs=0.1)


def test_what_is_so_deep_that_the_outermost_views_no_longer_overlap_is_left_out() -> None:
    rig = Rig.model_validate({"imaging_lens": None, "lens_array": {"count": [10, 10], "offset_mm": 0.0}})
    found = shown_depths(rig, FAR_OFF)
    layout, focal_mm = display_size(rig), rig.lens_array.focal_length_mm
    assert found.far_mm is not None
    assert found.far_mm < found.from_mm < 0 < found.to_mm
    _, across = checked_shifts(layout, found.from_mm, focal_mm=focal_mm)
    assert across * (layout.cell_cols - 1) == pytest.approx(-(layout.lens_cols - 1))
    with pytest.raises(LayoutError, match="overlap"):
        checked_shifts(layout, found.from_mm * layout.cell_cols, focal_mm=focal_mm)


def test_where_nobody_knows_the_scene_the_range_lies_round_the_display() -> None:
    rig = Rig.model_validate({"imaging_lens": None})
    found, layout = shown_depths(rig, None), display_size(rig)
    assert (found.near_mm, found.reference_mm, found.far_mm) == (None, None, None)
    assert found.from_mm == -found.to_mm
    _, across = checked_shifts(layout, found.to_mm, focal_mm=rig.lens_array.focal_length_mm)
    assert across * (layout.cell_cols - 1) == pytest.approx((layout.lens_cols - 1) / 4)
