"""What an observer sees, as outputs of a job."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lippmann.errors import LayoutError, SpecError
from lippmann.job.outputs.observer import ObserverVideo
from lippmann.job.spec import parse_spec
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.observer.observe import observe, whole_window
from lippmann.lightfield.observer.viewing_conditions import ViewingConditions, observed_picture
from lippmann.lightfield.sheet.device import to_device
from lippmann.lightfield.views.perspective import Eye
from lippmann.plan.design.observed_display import observed_display
from tests.builders import small_job
from tests.builders_outputs import GivenJob, given_job
from tests.pictures import read_png
from tests.unit.lippmann.lightfield.textures import sheet_of_texture, spot
from worker.images.colour import srgb_codes
from worker.tasks.outputs.frame_source import job_frames
from worker.tasks.outputs.observer import clip_moments
from worker.video.read import read_frames

LENSES = {"count": (12, 10), "px_per_lens": 8}
LAYOUT = CellLayout(12, 10, 8)


def point(depth_mm: float) -> np.ndarray:
    """Return the sheet of a point at a depth."""
    return sheet_of_texture(LAYOUT, spot, depth_mm, focal_mm=3.3).repeat(3, axis=2)


def job_of_points(folder: Path, *outputs: Any, **more: Any) -> GivenJob:
    """Return a job of two frames: a point in front of the display, then behind it."""
    return given_job(folder, {1: point(15), 2: point(-15)}, frames="1-2", outputs=list(outputs), **LENSES, **more)


def across(frames: list[np.ndarray]) -> list[float]:
    """Return where the light of frames is, px from the left."""
    return [
        float((frame.sum(axis=(0, 2), dtype=float) * np.arange(frame.shape[1])).sum() / frame.sum(dtype=float))
        for frame in frames
    ]


def test_a_clip_shows_real_points_go_against_the_eye_and_virtual_ones_with_it(tmp_path: Path) -> None:
    output = {"kind": "observer", "fps": 8, "seconds": 1, "distance_mm": 300, "size_px": 48, "codec": "ffv1"}
    for frame, sign in ((1, -1), (2, 1)):
        job = job_of_points(tmp_path / str(frame), {**output, "frame": frame})
        job.make("observer.mkv")
        with job.file("video/observer.mkv") as path:
            frames = list(read_frames(path))
        assert len(frames) == 8
        assert frames[0].shape == (48, 40, 3)
        places = across(frames)  # the eye is in the middle, 2 pictures later at the right, 4 more at the left
        assert sign * (places[2] - places[0]) > 0.5
        assert sign * (places[6] - places[0]) < -0.5


def test_a_picture_of_a_clip_is_what_the_observer_sees(tmp_path: Path) -> None:
    output = {"kind": "observer", "fps": 4, "seconds": 1, "distance_mm": 300, "size_px": 48, "codec": "ffv1"}
    job = job_of_points(tmp_path, {**output, "frame": 1, "path": "circle", "reach_mm": 12, "x_mm": 3, "pupil_mm": 5})
    job.make("observer.mkv")
    with job.file("video/observer.mkv") as path:
        frames = list(read_frames(path))
    display = observed_display(job.sheet.spec.rig)
    sheet, window = point(15).astype(np.float16), whole_window(display, size_px=48)
    for frame, eye in zip(frames, (Eye(15, 0, 300), Eye(3, 12, 300), Eye(-9, 0, 300), Eye(3, -12, 300)), strict=True):
        seen = observe(sheet, display, eye, pupil_mm=5.0, rays=16, window=window)
        np.testing.assert_array_equal(frame, srgb_codes(seen))


def test_time_runs_while_the_eye_moves(tmp_path: Path) -> None:
    job = job_of_points(tmp_path, fps=2.0)
    source = job_frames(job.artifacts, job.sheet)

    def frames(**options: Any) -> list[int]:
        return [moment.frame for moment in clip_moments(source, ObserverVideo(**options))]

    assert frames(fps=4, seconds=2) == [1, 1, 2, 2, 1, 1, 2, 2]
    assert frames(fps=1, seconds=3) == [1, 1, 1], "two frames a picture"
    assert frames(fps=4, seconds=1, frame=2) == [2, 2, 2, 2]
    assert len(frames()) == 4 * 24
    assert len(frames(periods=3)) == 12 * 24
    eyes = [moment.place for moment in clip_moments(source, ObserverVideo(path="still", seconds=1, y_mm=4))]
    assert set(eyes) == {Eye(0, 4, 1000)}, "where display.viewing_distance_mm says"
    with pytest.raises(LayoutError, match="comes nearer by less than its distance, 1000 mm, got 1000"):
        clip_moments(source, ObserverVideo(path="toward", reach_mm=1000))


def test_a_sequence_longer_than_the_eyes_way_is_shown_whole(tmp_path: Path) -> None:
    job = given_job(tmp_path, frames="1-10", fps=2.0, count=(2, 2))
    moments = clip_moments(job_frames(job.artifacts, job.sheet), ObserverVideo(fps=4))
    assert [moment.frame for moment in moments] == [frame for frame in range(1, 11) for _ in (0, 1)]


def test_pictures_are_what_two_eyes_see_of_a_devices_pixels_at_the_gap_that_the_job_says(tmp_path: Path) -> None:
    rig = {"device": {"dpi": 600, "margin_px": 3}}
    output = {"kind": "observer_pictures", "stereo": "anaglyph", "device": True, "gap": "real", "size_px": 60}
    job = job_of_points(
        tmp_path, {**output, "distance_mm": 400, "focus_mm": 20, "rays": 5}, rig=rig,
        display={"gap_real_mm": 4.8}, lens_array={"substrate_mm": 3.3},
    )  # fmt: skip
    job.make("observer_pictures.png")
    gap_mm = 1.5 + 3.3 / 1.49
    display = observed_display(job.sheet.spec.rig, gap_mm=gap_mm, on_device=True)
    sheet = to_device(point(-15).astype(np.float16), LAYOUT, px_per_lens_device=600 / 25.4, margin_px=3)
    conditions = ViewingConditions(stereo="anaglyph", focus_mm=20.0, rays=5)
    seen = observed_picture(sheet, display, Eye(0, 0, 400), conditions, window=whole_window(display, size_px=60))
    with job.file("exports/observer_pictures/0002.png") as path:
        np.testing.assert_array_equal(read_png(path), srgb_codes(seen))
    said = job.sidecar("observer_pictures.png")
    assert said["files"] == ["exports/observer_pictures/0001.png", "exports/observer_pictures/0002.png"]
    told = said["format"]
    assert told["gap_mm"] == pytest.approx(gap_mm)
    assert told["depths_times"] == pytest.approx(gap_mm / 3.3)
    assert told["central_depth_plane_mm"] == pytest.approx(29.556, abs=1e-3)
    assert told["viewing_zone_mm"] == pytest.approx(400 / gap_mm)
    assert (told["width_mm"], told["height_mm"], told["eye_mm"]) == (10, 12, [0, 0, 400])


def test_a_gap_that_is_thinner_than_its_glass_fails_this_output_alone(tmp_path: Path) -> None:
    outputs = [{"kind": "observer_pictures", "gap": "virtual"}, "view_grid.png"]
    job = job_of_points(tmp_path, *outputs, display={"gap_virtual_mm": 3.0}, lens_array={"substrate_mm": 3.3})
    with pytest.raises(LayoutError, match=r"expected a reduced gap of at least 2\.215 mm"):
        job.make("observer_pictures.png")
    job.make("view_grid.png")


@pytest.mark.parametrize(
    ("output", "rig", "said"),
    [
        ({"device": True}, {}, "outputs.0.device: expected false without rig.device, got true"),
        ({"distance_mm": 300, "focus_mm": 300}, {}, "outputs.0.focus_mm: expected a depth nearer to the display than"),
        ({"frame": 3}, {}, "outputs.0.frame: expected one of the job's frames, 1, got 3"),
        ({"path": "toward", "distance_mm": 300, "reach_mm": 300}, {}, "outputs.0.reach_mm: expected less than"),
        ({"path": "toward", "distance_mm": 300, "reach_mm": 280, "focus_mm": 30}, {}, "outputs.0.reach_mm: expected"),
        ({}, {"lens_array": {"substrate_mm": 10}}, "outputs.0.gap: expected real or virtual: the substrate alone"),
        ({"pupil_mm": 0}, {}, "outputs.0.pupil_mm: expected a number above 0, got 0"),
        ({"size_px": 0}, {}, "outputs.0.size_px: expected a number of at least 1, got 0"),
        ({"size_px": 9000}, {}, "outputs.0.size_px: expected a number of at most 8192, got 9000"),
        ({"path": "spiral"}, {}, "outputs.0.path: expected"),
        ({"stereo": "wiggle"}, {}, "outputs.0.stereo: expected"),
    ],
    ids=str,
)
def test_what_cannot_be_is_said_when_the_job_arrives(output: dict[str, Any], rig: dict[str, Any], said: str) -> None:
    with pytest.raises(SpecError) as refused:
        parse_spec({"scene": "fish", "rig": rig, "outputs": [{"kind": "observer", **output}]})
    assert said in refused.value.message


def test_short_spellings_are_the_usual_ones() -> None:
    spec = small_job("fish", outputs=["observer.mp4", "observer.mkv", "observer_pictures.png"])
    assert [output.file_name for output in spec.outputs] == ["observer.mp4", "observer.mkv", "observer_pictures.png"]
