"""What a depth pass makes of POV-Ray's codes: distances, and another try where rays start inside solid objects."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from lippmann.errors import SceneError
from lippmann.job.scenes.stage import Stage
from worker.engines.povray.pictures.depth_codes import MARK, TOP, fog_light, fog_light_among_others
from worker.engines.povray.scene import FAR, DepthPass
from worker.tasks.attempts.monitor import NullMonitor, PartMonitor
from worker.tasks.frames.depth_pass import FAR_AWAY, found_light

NEAR_MM = 800.0
STAGE = Stage(location=(1, 2, 3), look_at=(1, 2, 30), near_mm=800, far_mm=900)

Codes = NDArray[np.uint16]


def codes_of(distance_mm: NDArray[np.float64], *, amplitude: float = 1.0, own: float = 0.0) -> Codes:
    """Return what POV-Ray writes: our fogs, whose light is added to that of the scene's own."""
    light = np.stack(
        [
            -np.expm1(-distance_mm / NEAR_MM),
            -np.expm1(-distance_mm / (FAR * NEAR_MM)),
            np.full(distance_mm.shape, MARK),
        ],
        axis=-1,
    )
    return np.rint(np.clip(amplitude * light + own, 0, 1) * TOP).astype(np.uint16)


@given(st.floats(1.0, 300_000.0))
def test_a_distance_comes_back_to_half_a_step_of_the_finer_scale(distance_mm: float) -> None:
    there = np.full((1, 1), distance_mm)
    light = fog_light(codes_of(there))
    assert light.is_whole
    half_step_mm = min(scale * np.exp(distance_mm / scale) / TOP for scale in (NEAR_MM, FAR * NEAR_MM)) / 2
    found = light.distance_mm(near_mm=NEAR_MM)[0, 0]
    # The step is taken at the rounded code, beside the place.
    assert abs(found - distance_mm) <= 1.6 * half_step_mm


def test_where_nothing_is_met_there_is_no_distance() -> None:
    assert np.isnan(fog_light(codes_of(np.full((2, 2), 1e10))).distance_mm(near_mm=NEAR_MM)).all()


@given(st.floats(1.0, 3000.0), st.floats(0.0, 1.0))
def test_fog_of_the_scene_is_told_from_ours(distance_mm: float, own: float) -> None:
    there = np.full((1, 1), distance_mm)
    light = fog_light_among_others(*(codes_of(there, amplitude=a, own=own) for a in (0.0, 0.5, -0.5)))
    assert light.is_whole
    step_mm = NEAR_MM * np.exp(distance_mm / NEAR_MM) / TOP
    assert abs(light.distance_mm(near_mm=NEAR_MM)[0, 0] - distance_mm) <= 2.5 * step_mm


class Scene:
    """A POV-Ray that computes fog only for rays that start where `hollow` says, and remembers where it was asked to."""

    def __init__(self, hollow: int) -> None:
        self.hollow = hollow
        self.asked: list[tuple[float, float, float]] = []

    def __call__(self, depth: DepthPass) -> Codes:
        if depth.outside not in self.asked:
            self.asked.append(depth.outside)
        there = np.full((2, 3), 700.0)
        if len(self.asked) > self.hollow:
            return codes_of(there, amplitude=depth.amplitude)
        return np.full((2, 3, 3), 20_000, dtype=np.uint16)


@pytest.mark.parametrize("foggy", [False, True])
@pytest.mark.parametrize("hollow", [0, 1, 6])
def test_rays_that_start_inside_something_solid_are_tried_from_elsewhere(hollow: int, foggy: bool) -> None:
    scene = Scene(hollow)
    light = found_light(scene, DepthPass(outside=(0, 0, 0), cols=3, near_mm=NEAR_MM), STAGE, foggy=foggy)
    assert light.distance_mm(near_mm=NEAR_MM) == pytest.approx(700.0, abs=0.1)
    assert len(scene.asked) == hollow + 1
    above, here = (1, 2 + FAR_AWAY, 3), (1, 2, 3)
    assert scene.asked[:2] == [above, here][: hollow + 1], "far above first, then where the rig stands"


def test_a_rig_in_something_solid_without_end_is_an_error_of_the_scene() -> None:
    with pytest.raises(SceneError, match="expected a place outside of all objects that are not hollow"):
        found_light(Scene(99), DepthPass(outside=(0, 0, 0), cols=3, near_mm=NEAR_MM), STAGE, foggy=False)


def test_progress_of_a_part_is_that_of_the_whole() -> None:
    whole = NullMonitor()
    part = PartMonitor(whole, 0.5, 1.0)
    part.progress = 0.5
    assert whole.progress == part.progress == 0.75
