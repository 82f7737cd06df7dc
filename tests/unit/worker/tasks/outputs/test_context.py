"""Every output: made once, whole or not at all, with what is told beside it."""

from __future__ import annotations

import weakref
from collections.abc import Iterator
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest

from lippmann.errors import ArtifactBroken, ArtifactMissing, Stopped
from lippmann.job.outputs.videos import CentreVideo
from lippmann.lightfield.depth.depth_map import CHANNELS
from lippmann.lightfield.views.views import views_grid
from lippmann.plan import artifact_names as names
from tests.builders_outputs import given_job
from tests.pictures import read_png
from worker.images.colour import srgb_codes
from worker.images.read import read_rgb
from worker.images.write import write_channels
from worker.tasks.local import JOB_ID
from worker.tasks.outputs import videos as encoding
from worker.tasks.outputs.context import OutputContext
from worker.tasks.outputs.frame_source import FrameSource
from worker.tasks.outputs.videos import Picture, again


class EndsAfter:
    """A monitor that stops the work after a number of questions."""

    def __init__(self, looks: int) -> None:
        self.progress = 0.0
        self.looks = looks

    def should_stop(self) -> bool:
        self.looks -= 1
        return self.looks < 0

    def announce_end(self) -> None: ...


def test_the_view_grid_is_all_views_as_codes_one_file_a_frame(tmp_path: Path) -> None:
    job = given_job(tmp_path, frames="1-2", outputs=["view_grid.png"])
    job.make("view_grid.png")
    for frame in (1, 2):
        with job.file(names.orthoscopic_name(frame)) as master:
            expected = srgb_codes(views_grid(read_rgb(master, np.float32), job.layout))
        with job.file(f"exports/view_grid/{names.frame_stem(frame)}.png") as made:
            np.testing.assert_array_equal(read_png(made), expected)


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


def test_a_file_that_is_made_when_the_work_should_end_is_not_stored(tmp_path: Path) -> None:
    stored = list[str]()
    context = OutputContext(
        source=cast(FrameSource, None),  # no frame is read
        output=CentreVideo(), scratch=tmp_path, put=lambda name, path: stored.append(name), exists=lambda name: False,
        monitor=EndsAfter(0),
    )  # fmt: skip
    with pytest.raises(Stopped):
        context.store_file("centre.mp4", lambda path: path.touch())
    assert (stored, context.stored) == ([], [])


class Tells:
    """A monitor that records the progress and stops the work at a value."""

    def __init__(self, stop_at: float = 2.0) -> None:
        self.told, self.stop_at = [0.0], stop_at

    @property
    def progress(self) -> float:
        return self.told[-1]

    @progress.setter
    def progress(self, fraction: float) -> None:
        self.told.append(fraction)

    def should_stop(self) -> bool:
        return self.progress >= self.stop_at

    def announce_end(self) -> None: ...


LONG: list[dict[str, Any]] = [
    {"kind": "hci", "disparity": "none"},
    {"kind": "subaperture_ppm"},
    {"kind": "print", "dpi": 300, "file_format": "png"},
]
"""Of a frame that takes long, more is told than that it was begun."""


@pytest.mark.parametrize("output", LONG, ids=lambda output: str(output["kind"]))
def test_a_long_frame_tells_how_far_it_is_and_can_be_stopped_meanwhile(tmp_path: Path, output: dict[str, Any]) -> None:
    job = given_job(tmp_path, frames="1-2", count=(24, 20), outputs=[output])
    (name,) = (one.file_name for one in job.sheet.spec.outputs)
    with pytest.raises(Stopped):
        job.make(name, Tells(stop_at=0.1))
    monitor = Tells()
    job.make(name, monitor)
    assert monitor.told == sorted(monitor.told)
    assert len({told for told in monitor.told if told < 0.5}) > 3
    assert len({told for told in monitor.told if told > 0.5}) > 3


@pytest.mark.parametrize("output", ["centre.mkv", "npz.npz", {"kind": "print", "dpi": 300}, {"kind": "depth"}], ids=str)
def test_a_master_that_is_cut_short_or_gone_is_named_and_may_be_there_at_the_next_attempt(
    tmp_path: Path, output: Any
) -> None:
    depth = isinstance(output, dict) and output["kind"] == "depth"
    made_of = names.depth_name if depth else names.orthoscopic_name
    job = given_job(tmp_path, frames="1-2", outputs=[output], capture={"depth": depth})
    (name,) = (one.file_name for one in job.sheet.spec.outputs)
    size = job.layout.rows, job.layout.cols
    for frame in (1, 2) if depth else ():
        write_channels(tmp_path / "d.exr", (np.ones((*size, 4), np.float32),), CHANNELS, size=size, attributes={})
        job.place.store.put_file(f"{JOB_ID}/{made_of(frame)}", tmp_path / "d.exr")
    master = f"{JOB_ID}/{made_of(2)}"
    whole = job.place.store.get_bytes(master)
    job.place.store.put_bytes(master, whole[: len(whole) // 2])
    with pytest.raises(ArtifactBroken, match=r"0002\.exr"):
        job.make(name)
    job.place.store.delete(master)
    with pytest.raises(ArtifactMissing, match=r"0002\.exr"):
        job.make(name)
    job.place.store.put_bytes(master, whole)
    job.make(name)


@pytest.mark.parametrize("room", [0, 100, 2**20])
def test_pictures_that_are_shown_again_hold_no_sheets_and_no_more_than_there_is_room_for(
    monkeypatch: pytest.MonkeyPatch, room: int
) -> None:
    monkeypatch.setattr(encoding, "KEPT_BYTES", room)
    sheets: list[weakref.ref[Any]] = []

    def views() -> Iterator[Picture]:
        for number in range(5):
            sheet = np.full((8, 8, 3), number, np.float32)
            sheets.append(weakref.ref(sheet))
            yield sheet[::4, ::4]

    shown = []
    for picture in again(views, 3):
        assert sum(sheet() is not None for sheet in sheets) <= 2
        shown.append(float(picture[0, 0, 0]))
        del picture
    assert shown == [0, 1, 2, 3, 4] * 3
    assert len(sheets) == (5 if room == 2**20 else 15)
