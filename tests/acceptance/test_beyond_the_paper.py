"""A job with what the paper varies and more, through the farm: hexagons, a moving array, a printer, the ray camera."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import av
import numpy as np
import pytest

from lippmann.client.fetch import fetch_job
from service.schemas.job import Job
from tests.farm import Farm, ended, farm_up
from tests.pictures import read_png

LENS_ROWS, LENS_COLS = 24, 20

JOB = {
    "scene": "target-letter",
    "frames": "1-2",
    "rig": {
        "imaging_lens": {"name": "double-gauss-tronnier", "focal_length_mm": 300},
        "lens_array": {
            "lattice": "hexagonal",
            "count": [LENS_ROWS, LENS_COLS],
            "pitch_mm": 2,
            "focal_length_mm": 6.6,
            "offset_mm": {"keyframes": [[1, 40], [2, -30]]},
        },
        "px_per_lens": 4,
        "device": {"dpi": 60, "window_px": [120, 120]},
    },
    "capture": {"method": "ray_camera", "supersample": 2},
    "render": {"tiles": [2, 1]},
    "outputs": ["views.mp4", "orthoscopic.mkv"],
}


@pytest.fixture(scope="module")
def farm(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Farm]:
    with farm_up(tmp_path_factory.mktemp("farm") / "data") as up:
        yield up


@pytest.fixture(scope="module")
def job(farm: Farm) -> Job:
    return ended(farm.client, farm.client.submit(JOB).id)


@pytest.fixture(scope="module")
def out(farm: Farm, job: Job, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("out")
    fetch_job(farm.client, job.id, folder)
    return folder


def test_it_is_done_and_says_how_the_picture_moves_through_the_array(job: Job) -> None:
    assert job.status == "done", job.error
    assert (job.frames_done, job.size.lens_rows, job.size.lens_cols) == (2, LENS_ROWS, LENS_COLS)
    assert job.notes[0].startswith("From frame 1: The array stands in the image space")
    assert job.notes[1].startswith("From frame 2: The array stands outside the image space, on the camera's side")


def test_the_keyframes_come_back_as_they_were_asked_for(job: Job) -> None:
    assert job.spec.animation["rig.lens_array.offset_mm"].keyframes == ((1, 40), (2, -30))


@pytest.mark.parametrize("kind", ["integral", "orthoscopic", "device", "views"])
def test_the_two_frames_differ_by_where_the_array_stands(out: Path, kind: str) -> None:
    first, second = (read_png(out / kind / f"{frame:04d}.png").astype(int) for frame in (1, 2))
    assert first.shape == second.shape
    assert np.abs(first - second).mean() > 2


def test_the_sheet_for_the_printer_is_the_window_that_was_asked_for(out: Path) -> None:
    printed = read_png(out / "device" / "0001.png")
    assert printed.shape == (120, 120, 3)
    # 24 rows of hexagons of 2 mm are 42.1 mm high, and 20.5 of them 41 mm wide: 99 x 97 px of 0.423 mm.
    assert not printed[:10].any()
    assert not printed[:, :11].any()
    assert printed[20:100, 20:100].any(axis=-1).mean() > 0.5


def test_the_views_play_on_square_pixels(out: Path) -> None:
    with av.open(str(out / "video" / "views.mp4")) as video:
        stream = video.streams.video[0]
        # 21 rows of square pixels for 24 lens rows, 20 cols; every view of both frames: 3 rows of 4 px a hexagon.
        assert stream.width / stream.height == pytest.approx(20 / 21, abs=0.01)
        assert sum(1 for _ in video.decode(stream)) == 2 * 3 * 4
