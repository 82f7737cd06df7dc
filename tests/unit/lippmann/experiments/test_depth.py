"""Depth out of views: pictures that move by known amounts, and the exact trace beside an independent one."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from lippmann.experiments import settings
from lippmann.experiments.figures.depth import Patch, depth_mm, lenses_a_view, movement
from lippmann.experiments.landmarks import LANDMARKS, rig_place_mm, traced
from lippmann.job.scenes.scene import parse_scene
from lippmann.job.scenes.stage import Stage
from lippmann.optics.rig.bench import bench
from lippmann.optics.rig.disparity import exact_disparity
from lippmann.untrusted.toml_text import read_toml
from povtemplates.catalogue import MANIFEST, scene_folders

OPTICS = {"px_per_lens": 8, "focal_length_mm": 3.3}
TRIED = np.arange(-2.0, 2.0, 0.05)


def picture_at(cols: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a smooth picture without repetition, brightness at any place of a row."""
    return np.sin(0.9 * cols) + 0.5 * np.sin(0.37 * cols + 1) + 0.02 * cols


def moving_views(lenses: float, *, count: int = 8) -> NDArray[np.float64]:
    """Return views `(view, lens_row, lens_col)` of a picture that moves to the left as the eye moves right."""
    cols, rows = np.arange(60.0), np.arange(11.0)[:, np.newaxis]
    steps = np.arange(count) - (count - 1) / 2
    return np.stack([picture_at(cols + lenses * step) * (1 + 0.1 * rows) for step in steps])


@pytest.mark.parametrize("lenses", [-1.4, -0.33, -0.02, 0.0, 0.02, 0.5, 1.31])
def test_a_movement_is_found_with_its_sign(lenses: float) -> None:
    found = movement(moving_views(lenses), Patch(5, 30, 3, 8), TRIED)
    assert found is not None
    assert found.lenses_a_view == pytest.approx(lenses, abs=0.02)
    assert found.likeness > 0.95


def test_a_patch_that_is_not_its_own_in_other_views_is_not_alike() -> None:
    noise = np.random.default_rng(1).random((8, 11, 60))
    found = movement(noise, Patch(5, 30, 3, 8), TRIED)
    assert found is not None
    assert found.likeness < 0.4


@pytest.mark.parametrize("patch", [Patch(1, 30, 3, 8), Patch(5, 2, 3, 8), Patch(5, 58, 3, 8)])
def test_a_patch_outside_the_picture_has_no_movement(patch: Patch) -> None:
    assert movement(moving_views(0.0), patch, TRIED) is None


def test_a_black_picture_has_no_movement() -> None:
    assert movement(np.zeros((8, 11, 60)), Patch(5, 30, 3, 8), TRIED) is None


@given(s_mm=st.floats(-100, 100))
def test_depth_and_movement_are_inverses(s_mm: float) -> None:
    assert depth_mm(lenses_a_view(s_mm, **OPTICS), **OPTICS) == pytest.approx(s_mm, abs=1e-6)  # type: ignore[arg-type]


def fish_stage() -> Stage:
    return parse_scene(read_toml((scene_folders()["fish"] / MANIFEST).read_bytes(), field=MANIFEST)).stage


def test_a_place_of_the_scene_comes_to_the_rig_frame() -> None:
    """The lens of the fish scene stands at (0, 60, -1000) and looks along +z; the z of the rig points back."""
    assert rig_place_mm((10.0, 80.0, 375.0), fish_stage()) == pytest.approx([10.0, 20.0, -1375.0])


def test_a_stage_that_looks_elsewhere_has_its_own_left_and_right() -> None:
    stage = Stage(location=(0, 0, 0), look_at=(5, 0, 0), mm_per_unit=2, near_mm=1, far_mm=2)
    # Looking along +x with y up, in a left-handed frame, the right hand points to -z.
    assert rig_place_mm((3.0, 1.0, -4.0), stage) == pytest.approx([8.0, 2.0, -6.0])


@pytest.mark.parametrize("frame", [1, 2, 3, 4])
@pytest.mark.parametrize("distance_mm", [1000.0, 1750.0, 2500.0])
def test_a_point_on_the_axis_moves_as_the_one_of_another_trace(frame: int, distance_mm: float) -> None:
    """`exact_disparity` looks for the lens that sees the axis; here it is found among the pixels of a whole array."""
    optical_bench = bench(settings.sweep(px_per_lens=8).at(frame).rig, reference_mm=1000.0)
    expected = exact_disparity(optical_bench, distance_mm)
    found = traced(optical_bench, np.array([0.0, 0.0, -distance_mm])).lenses_a_view
    assert found == pytest.approx(expected, abs=0.03)


def test_the_landmarks_stand_where_the_middle_view_of_the_exact_trace_sees_them() -> None:
    """Further right in the scene is further right over the lenses, and higher up is in a smaller row."""
    stage = fish_stage()
    optical_bench = bench(settings.sweep(px_per_lens=8).at(2).rig, reference_mm=1000.0)
    for landmark in LANDMARKS:
        place = rig_place_mm(landmark.place, stage)
        found = traced(optical_bench, place)
        assert np.sign(found.lens_col.mean() - 49.5) == np.sign(place[0]) or abs(place[0]) < 1
        assert found.lens_row.mean() <= 49.6
