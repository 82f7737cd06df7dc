"""Every output: made once, whole or not at all, with what is told beside it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.builders_outputs import given_job
from worker.errors import Stopped
from worker.images.colour import srgb_codes
from worker.images.read import read_codes_8, read_rgb
from worker.integral.views import views_grid
from worker.plan import names
from worker.tasks.local import JOB_ID


class EndsAfter:
    """A watch that says stop after so many looks."""

    def __init__(self, looks: int) -> None:
        self.progress = 0.0
        self.looks = looks

    def should_stop(self) -> bool:
        self.looks -= 1
        return self.looks < 0


def test_the_view_grid_is_all_views_as_codes_one_file_a_frame(tmp_path: Path) -> None:
    job = given_job(tmp_path, frames="1-2", outputs=["view_grid.png"])
    job.make("view_grid.png")
    for frame in (1, 2):
        with job.file(names.orthoscopic_name(frame)) as master:
            expected = srgb_codes(views_grid(read_rgb(master, np.float32), job.layout))
        with job.file(f"exports/view_grid/{names.frame_stem(frame)}.png") as made:
            np.testing.assert_array_equal(read_codes_8(made), expected)


def test_a_sidecar_names_the_files_and_says_how_the_pixels_lie(tmp_path: Path) -> None:
    job = given_job(tmp_path, frames="1-2", outputs=["view_grid.png"], lens_array={"lattice": "hexagonal"})
    job.make("view_grid.png")
    said = job.sidecar("view_grid.png")
    assert said["files"] == ["exports/view_grid/0001.png", "exports/view_grid/0002.png"]
    assert said["source"]["job"] == JOB_ID
    image = said["integral_image"]
    assert (image["lattice"], image["lens_rows"], image["pitch_px"]) == ("hexagonal", 6, 4)
    assert set(said["made_with"]) >= {"lippmann", "numpy"}


def test_an_output_that_was_stopped_goes_on_where_it_was(tmp_path: Path) -> None:
    job = given_job(tmp_path, frames="1-3", outputs=["view_grid.png"])
    with pytest.raises(Stopped):
        job.make("view_grid.png", EndsAfter(2))
    first = job.place.store.etag(f"{JOB_ID}/exports/view_grid/0001.png")
    assert not job.place.store.exists(f"{JOB_ID}/exports/view_grid.png.json")
    job.make("view_grid.png")
    assert job.place.store.etag(f"{JOB_ID}/exports/view_grid/0001.png") == first
    assert job.place.store.exists(f"{JOB_ID}/exports/view_grid/0003.png")


def test_a_video_is_there_only_after_what_is_told_beside_it(tmp_path: Path) -> None:
    job = given_job(tmp_path, frames="1-2", outputs=["centre.mkv"])
    with pytest.raises(Stopped):
        job.make("centre.mkv", EndsAfter(1))
    assert not job.place.store.exists(f"{JOB_ID}/video/centre.mkv")
    job.make("centre.mkv")
    assert job.sidecar("centre.mkv")["files"] == ["video/centre.mkv"]
