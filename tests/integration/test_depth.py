"""The depth of every pixel, as the second pass finds it, against surfaces whose places are known exactly."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from lippmann.errors import ArtifactMissing
from lippmann.job.messages.orders import TaskKind
from lippmann.job.resolved import ResolvedJob
from lippmann.job.spec import JobSpec
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.depth.depth_map import CHANNELS, DepthMap
from lippmann.lightfield.refocus.shift_and_sum import shifts
from lippmann.lightfield.sheet.orthoscopic import orthoscopic
from lippmann.lightfield.views.views import view
from lippmann.optics.lens.trace import Rays
from lippmann.optics.rig.bench import bench, object_rays, pixel_centres_mm
from lippmann.optics.rig.parallax import parallax
from lippmann.plan import artifact_names as names
from lippmann.plan.sampling import display_size, frame_size
from tests.builders import artifacts_of, local_place, order_of, small_job, stored_job, tiles_of
from worker.images.read import read_channels
from worker.sandbox.bundle import pack_folder
from worker.sandbox.log import AttemptLog
from worker.tasks.attempts.monitor import NullMonitor
from worker.tasks.attempts.workplace import Workplace
from worker.tasks.frames.assemble import assemble_frame
from worker.tasks.frames.depth_pass import depth_of_tile
from worker.tasks.frames.render import render_tile
from worker.tasks.local import JOB_ID, local_job
from worker.tasks.outputs.frame_source import job_frames

NEAR_MM = 1000.0
"""Of the scenes' stage, and so the scale D of the distances."""

NOT_TOLD_MM = 2e-3
"""Of a ray: how far POV-Ray's 32-bit vertices move where it starts."""


def precision_mm(distance_mm: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return half a step of the 16-bit codes of 1 - exp(-d / D) at a distance, with room for the ray's own error."""
    step_mm: NDArray[np.float64] = NEAR_MM * np.exp(distance_mm / NEAR_MM) / 65535
    return 0.55 * step_mm + NOT_TOLD_MM


def depth_of(place: Workplace, spec: JobSpec) -> DepthMap:
    """Return the depth of a stored job's first frame as it lies in the store."""
    for tile in tiles_of(spec):
        render_tile(place, order_of(TaskKind.RENDER, tile=tile), NullMonitor())
    assemble_frame(place, order_of(TaskKind.ASSEMBLE), NullMonitor())
    with place.store.local_path(names.job_artifact(JOB_ID, names.depth_name(1))) as path:
        return DepthMap(read_channels(path, CHANNELS))


def depth_alone(place: Workplace, sheet: ResolvedJob) -> DepthMap:
    """Return the depth of a stored job's first frame as captured, without its colours."""
    (tile,) = tiles_of(sheet.spec)
    with place.task_folder() as folder, AttemptLog(folder.with_suffix(".txt")) as log:
        return depth_of_tile(place, sheet, 1, tile, folder=folder, log=log, monitor=NullMonitor())


def upright(values: NDArray[Any], spec: JobSpec) -> NDArray[Any]:
    return orthoscopic(values, frame_size(spec.rig), inverted=spec.rig.imaging_lens is not None)


BENCHES: dict[str, dict[str, Any]] = {
    "square, in tiles, supersampled": {"capture": {"supersample": 2}, "tiles": [1, 2]},
    "hexagonal, odd lens rows, through glass": {
        "lens_array": {"lattice": "hexagonal"},
        "count": (13, 12),
        "capture": {"method": "glass"},
    },
    "inscribed, stopped down": {"lens_array": {"aperture": "inscribed"}, "rig": {"f_number": 4.0}, "count": (40, 12)},
    "direct pickup": {"rig": {"imaging_lens": None}, "lens_array": {"offset_mm": -200.0}},
}


@pytest.mark.parametrize("changes", BENCHES.values(), ids=BENCHES.keys())
def test_a_plane_is_where_it_stands_and_moves_as_exact_rays_say(tmp_path: Path, changes: dict[str, Any]) -> None:
    capture = {"depth": True, **changes.get("capture", {})}
    spec = small_job("target-position", **{"count": (12, 12), **changes, "capture": capture})
    place = local_place(tmp_path)
    stored_job(place, spec)
    found = depth_of(place, spec)
    optical_bench = bench(spec.rig, reference_mm=1000.0)
    points = pixel_centres_mm(optical_bench)
    rays = object_rays(optical_bench, points)
    hits = rays.at_z(-1000.0)
    seen = np.asarray((np.abs(hits[..., :2]) < 400).all(axis=-1))
    assert 0.3 < seen.mean() <= 1
    away_mm = np.linalg.norm(hits - rays.position, axis=-1)
    error_mm = np.abs(found.z_mm - 1000.0)
    met = np.isfinite(found.z_mm)
    np.testing.assert_array_equal(met, upright(seen[..., np.newaxis], spec)[..., 0])
    most_mm = precision_mm(upright(away_mm[..., np.newaxis], spec)[..., 0])
    np.testing.assert_array_less(error_mm[met], most_mm[met])
    moves = upright(parallax(optical_bench, points, np.where(seen, -1000.0, np.nan)), spec)
    # What half a step of z comes to: depth on the display goes with the square of the magnification, 0.28.
    moves = np.where(met[..., np.newaxis], moves, np.nan)
    np.testing.assert_allclose(found.values[..., 2:], moves, atol=4e-4, rtol=1e-4)
    per_mm = np.array(shifts(display_size(spec.rig), 1.0, focal_mm=spec.rig.lens_array.focal_length_mm))
    shown_mm = (found.values[..., 2:] / per_mm[::-1]).mean(axis=-1)
    assert found.s_mm == pytest.approx(shown_mm, rel=1e-5, nan_ok=True)


SCENE = """#version 3.6;
global_settings { assumed_gamma 2.2 }
camera { location -500 * z }
light_source { <0, 500, -900>, rgb 4 }
background { rgb <0.2, 0.9, 0.618> }
sphere { <4, -2, 0>, 8 pigment { rgb <1, 0.5, 0.618> } finish { ambient 0.5 diffuse 1 specular 3 reflection 0.6 } }
sphere { <14, 3, -6>, 4 pigment { rgbt 0.95 } interior { ior 1.5 } }
"""
MORE: dict[str, str] = {
    "alone": "",
    "inside a solid ball": "sphere { 0, 50000 pigment { rgb 1 } }",
    "in a solid room and below a solid sky": "box { -3000, 3000 inverse pigment { rgb 1 } } plane { y, 4000 }",
    "in fog": "fog { distance 700 color rgb <0.9, 0.8, 0.4> } fog { fog_type 2 distance 300 color rgb 0.2 fog_alt 10 }",
}


@pytest.mark.parametrize("more", MORE.values(), ids=MORE.keys())
def test_a_ball_is_where_it_stands_whatever_else_the_scene_says(tmp_path: Path, more: str) -> None:
    (tmp_path / "own").mkdir()
    (tmp_path / "own" / "ball.pov").write_text(SCENE + more)
    (tmp_path / "own" / "scene.toml").write_text(
        'file = "ball.pov"\n[stage]\nlocation = [0.0, 0.0, -500.0]\nlook_at = [0.0, 0.0, 0.0]\nmm_per_unit = 2.0\n'
        "near_mm = 1000.0\nfar_mm = 1500.0\n"
    )
    spec = small_job("own", count=(16, 16), px_per_lens=4, capture={"depth": True})
    place = local_place(tmp_path / "data")
    sheet = local_job(place, spec, pack_folder(tmp_path / "own"))
    z_mm = upright(depth_alone(place, sheet).z_mm[..., np.newaxis], spec)[..., 0]
    optical_bench = bench(spec.rig, reference_mm=1000.0)
    rays = object_rays(optical_bench, pixel_centres_mm(optical_bench))
    # In the rig's frame z grows toward the camera, and the observer's right is the scene's.
    away_mm = np.fmin(to_ball(rays, (8, -4, -1000), 16.0), to_ball(rays, (28, 6, -988), 8.0))
    expected = -(rays.position + away_mm[..., np.newaxis] * rays.direction)[..., 2:]
    expected, away_mm = upright(expected, spec)[..., 0], upright(away_mm[..., np.newaxis], spec)[..., 0]
    hit = np.isfinite(expected)
    assert 0.2 < hit.mean() < 0.9
    # Among fog of the scene, the difference of two codes of half the height.
    steps = 4.0 if "fog" in more else 1.0
    assert (np.abs(z_mm - expected) <= steps * precision_mm(away_mm))[hit].all()
    if more in ("", MORE["in fog"]):
        assert np.isnan(z_mm[~hit]).all(), "sky"
    else:
        assert (z_mm[~hit] > 2000).all()


def to_ball(rays: Rays, middle: tuple[float, float, float], radius_mm: float) -> NDArray[np.float64]:
    """Return how far along their ray a ball stands; NaN where it is missed."""
    to_middle = np.array(middle) - rays.position
    along = (to_middle * rays.direction).sum(axis=-1)
    square = radius_mm**2 - (to_middle**2).sum(axis=-1) + along**2
    return np.where(square >= 0, along - np.sqrt(np.maximum(square, 0)), np.nan)


@pytest.mark.parametrize("lattice", ["square", "hexagonal"])
def test_a_ball_wanders_over_the_views_as_its_depth_says(tmp_path: Path, lattice: str) -> None:
    """From the middle view to the next ones: the middle of the picture of the ball against the disparity in it."""
    spec = small_job(
        "target-points",
        count=(15, 14),
        lens_array={"lattice": lattice},
        parameters={"distance_mm": 1050.0, "radius_mm": 10.0},
        capture={"depth": True, "supersample": 2},
    )
    place = local_place(tmp_path)
    sheet = stored_job(place, spec)
    found = depth_of(place, spec)
    source = job_frames(artifacts_of(place), sheet)
    layout = source.layout
    np.testing.assert_array_equal(source.depth(1).values, found.values)
    u, v = layout.cell_cols // 2, layout.cell_rows // 2
    before, after = (middle_of(view(source.image(1).pixels, layout, there, v), layout) for there in (u - 1, u + 1))
    shown = found.view(layout, u, v)
    assert (np.isfinite(shown.z_mm).sum()) > 15, "the ball, and nothing else"
    assert (before - after) / 2 == pytest.approx(float(np.nanmean(shown.disparity_u)), rel=0.03)
    with pytest.raises(ArtifactMissing, match=r"depth/0002\.exr"):
        source.depth(2)


def middle_of(picture: NDArray[np.float16], layout: CellLayout) -> float:
    """Return how far to the right the middle of the light in a view is, in pitches."""
    shift = [layout.shift_px(row) / layout.px_per_lens for row in range(layout.lens_rows)]
    x = np.arange(layout.lens_cols) + np.array(shift)[:, np.newaxis]
    light = picture[..., 0].astype(np.float64)
    return float((light * x).sum() / light.sum())
