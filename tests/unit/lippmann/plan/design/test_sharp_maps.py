"""Depths at which to focus: the table against single traces, and estimates against what neighbouring views show."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from lippmann.job.optics.rig import Rig
from lippmann.job.scenes.stage import Stage
from lippmann.lightfield.views.views import centre
from lippmann.optics.rig.sharp_depth import sharp_depth_mm, view_offset_mm
from lippmann.plan.design.sharp_maps import View, focus_of_estimate, focus_of_point, focus_of_scene, view_of
from lippmann.plan.sampling import display_size

STAGE = Stage(location=(0, 0, 0), look_at=(0, 0, 1), near_mm=1000.0, far_mm=2500.0)
RIGS: dict[str, dict[str, Any]] = {
    "square": {},
    "hexagonal": {"lens_array": {"lattice": "hexagonal"}},
    "perspective": {"camera": {"projection": "perspective"}},
    "direct pickup": {"imaging_lens": None, "lens_array": {"offset_mm": -20.0}},
}


def view_by(changes: dict[str, Any]) -> View:
    rig = Rig.model_validate({**changes, "lens_array": {"count": [60, 50], **changes.get("lens_array", {})}})
    return view_of(rig, STAGE, centre(display_size(rig)))


@pytest.mark.parametrize("changes", RIGS.values(), ids=RIGS.keys())
def test_the_map_of_a_scene_is_the_trace_of_each_pixel(changes: dict[str, Any]) -> None:
    view = view_by(changes)
    rows, cols = view.layout.square_size()
    z_mm = np.random.default_rng(2).uniform(900, 2500, (rows, cols)).astype(np.float32)
    z_mm[3, 4] = np.nan
    found = focus_of_scene(view, z_mm)
    assert np.isnan(found[3, 4])
    assert np.isfinite(found).sum() == rows * cols - 1
    for place in ((rows // 2, cols // 2), (0, 0), (5, cols - 3), (rows - 1, cols // 3)):
        exact_mm = focus_of_point(view, place, float(z_mm[place]))
        assert found[place] == pytest.approx(exact_mm, abs=0.5, rel=0.01), place


@pytest.mark.parametrize("changes", [RIGS["square"], RIGS["hexagonal"]], ids=["square", "hexagonal"])
def test_an_estimate_between_neighbours_becomes_the_depth_of_all_views(changes: dict[str, Any]) -> None:
    view = view_by(changes)
    rows, cols = view.layout.square_size()
    (u, v), rig = view.number, view.bench.rig
    near = [(u + k, v) for k in (-2, -1, 0, 1, 2)] + [(u, v + k) for k in (-2, -1, 1, 2)]
    offsets = np.array([view_offset_mm(rig, view.layout, *number) for number in near])
    local_mm = float(sharp_depth_mm(view.bench, np.array([0.0, 0.0, -1300.0]), offsets))
    found = focus_of_estimate(view, STAGE, np.full((rows, cols), local_mm, np.float32), reach=2)
    exact_mm = focus_of_point(view, (rows // 2, cols // 2), 1300.0)
    assert exact_mm is not None
    assert local_mm - exact_mm > 3  # what the estimate is off
    assert found[rows // 2, cols // 2] == pytest.approx(exact_mm, abs=0.3)


def test_an_estimate_of_nothing_stays_unknown() -> None:
    view = view_by({})
    rows, cols = view.layout.square_size()
    assert np.isnan(focus_of_estimate(view, STAGE, np.full((rows, cols), np.nan, np.float32), reach=2)).all()
    assert np.isnan(focus_of_scene(view, np.full((rows, cols), np.nan, np.float32))).all()


@pytest.mark.parametrize("z_mm", [float("nan"), float("inf"), -1.0])
def test_a_pixel_that_shows_no_surface_has_no_depth(z_mm: float) -> None:
    assert focus_of_point(view_by({}), (10, 10), z_mm) is None
