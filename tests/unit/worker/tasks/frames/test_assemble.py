"""A frame that does not fit in memory is assembled into the same files as one that does."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lippmann.errors import ArtifactBroken, Stopped
from lippmann.job.messages.orders import TaskKind
from lippmann.job.rendering.channels import channels_in, objects_in, part_names
from lippmann.job.spec import JobSpec
from lippmann.lightfield.depth.depth_map import CHANNELS
from lippmann.plan import artifact_names as names
from tests.builders import local_place, order_of, small_job, stored_job, stored_picture, tiles_of
from worker.images.bands import rearrange, rows
from worker.images.read import read_attributes, read_channels
from worker.images.write import write_channels, write_exr
from worker.tasks.attempts.monitor import NullMonitor
from worker.tasks.attempts.workplace import Workplace
from worker.tasks.frames import assemble, masters
from worker.tasks.local import JOB_ID

PARTS = part_names(("normal", "object"))


def job_with_tiles(folder: Path, lattice: str, *, more_rows: int = 0) -> Workplace:
    """Store a job whose tiles are given, as noise; their depths and other channels, too."""
    place = local_place(folder)
    spec: JobSpec = small_job(
        "turning-knot", count=(9, 7), px_per_lens=8, tiles=[3, 2], lens_array={"lattice": lattice},
        rig={"device": {"dpi": 180}}, capture={"depth": True, "channels": ["object", "normal"]},
    )  # fmt: skip
    stored_job(place, spec)
    noise = np.random.default_rng(1)
    for tile in tiles_of(spec):
        size = tile.rows + more_rows, tile.cols
        light = noise.random((*size, 3)).astype(np.float16)
        write_exr(folder / "tile.exr", light, attributes={})
        place.store.put_file(names.job_artifact(JOB_ID, names.tile_name(1, tile.index)), folder / "tile.exr")
        depths = noise.random((*size, len(CHANNELS)), dtype=np.float32)
        write_channels(folder / "depth.exr", (depths,), CHANNELS, size=size, attributes={})
        place.store.put_file(names.job_artifact(JOB_ID, names.depth_tile_name(1, tile.index)), folder / "depth.exr")
        numbers = np.concatenate([light.astype(np.float32), np.ones((*size, 1), np.float32)], axis=-1)
        attributes = {"objects": '["knot", "plinth"]'}
        write_channels(folder / "channels.exr", (numbers,), PARTS, size=size, attributes=attributes)
        name = names.job_artifact(JOB_ID, names.channel_tile_name(1, tile.index))
        place.store.put_file(name, folder / "channels.exr")
    return place


def left(place: Workplace) -> dict[str, bytes]:
    masters = (names.integral_name, names.orthoscopic_name, names.depth_name, names.device_name, names.views_name)
    made = [names.job_artifact(JOB_ID, name(1)) for name in (*masters, names.channels_name, names.thumb_name)]
    return {name: place.store.get_bytes(name) for name in made}


@pytest.mark.parametrize("lattice", ["square", "hexagonal"])
def test_in_bands_or_whole_the_files_are_the_same(
    lattice: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = job_with_tiles(tmp_path / "whole", lattice)
    assemble.assemble_frame(whole, order_of(TaskKind.ASSEMBLE), NullMonitor())
    for module in (assemble, masters, rearrange):
        monkeypatch.setattr(module, "BAND_PX", 700)
    monkeypatch.setattr(rows, "BAND_BYTES", 4200)
    banded = job_with_tiles(tmp_path / "bands", lattice)
    assemble.assemble_frame(banded, order_of(TaskKind.ASSEMBLE), NullMonitor())
    assert left(banded) == left(whole)


def test_a_master_says_in_its_header_whether_it_is_orthoscopic_wherever_it_is_copied(tmp_path: Path) -> None:
    place = job_with_tiles(tmp_path, "square")
    assemble.assemble_frame(place, order_of(TaskKind.ASSEMBLE), NullMonitor())
    kinds = {
        names.integral_name: names.PSEUDOSCOPIC,
        names.orthoscopic_name: names.ORTHOSCOPIC,
        names.device_name: names.ORTHOSCOPIC,
        names.views_name: None,
        names.depth_name: None,
        names.channels_name: None,
    }
    copy = tmp_path / "copy.exr"
    for name, kind in kinds.items():
        copy.write_bytes(place.store.get_bytes(names.job_artifact(JOB_ID, name(1))))
        assert read_attributes(copy).get(names.KIND) == kind


def test_channels_stand_where_the_light_stands_and_their_file_names_them(tmp_path: Path) -> None:
    place = job_with_tiles(tmp_path, "hexagonal")
    assemble.assemble_frame(place, order_of(TaskKind.ASSEMBLE), NullMonitor())
    with place.store.local_path(names.job_artifact(JOB_ID, names.channels_name(1))) as path:
        attributes, found = read_attributes(path), read_channels(path, PARTS)
    assert channels_in(attributes) == ("normal", "object")
    assert objects_in(attributes) == ("knot", "plinth")
    light = stored_picture(place, names.orthoscopic_name(1)).astype(np.float32)
    outside = np.isnan(found[..., :3]).all(axis=-1)
    assert 0 < outside.mean() < 0.5
    assert (found[outside][:, 3] == 0).all()
    np.testing.assert_array_equal(found[~outside][:, :3], light[~outside])  # job_with_tiles gives both the same numbers
    assert (found[~outside][:, 3] > 0).all()


class Watcher:
    """Counts looks, and sees progress."""

    def __init__(self, stop_after: int | None = None) -> None:
        self.looks = 0
        self.seen = [0.0]
        self.stop_after = stop_after

    @property
    def progress(self) -> float:
        return self.seen[-1]

    @progress.setter
    def progress(self, part: float) -> None:
        self.seen.append(part)

    def should_stop(self) -> bool:
        self.looks += 1
        return self.looks == self.stop_after

    def announce_end(self) -> None: ...


def test_progress_rises_to_the_end_and_a_stop_is_heard(tmp_path: Path) -> None:
    place, monitor = job_with_tiles(tmp_path, "square"), Watcher()
    with pytest.raises(Stopped):
        assemble.assemble_frame(place, order_of(TaskKind.ASSEMBLE), Watcher(stop_after=5))
    assemble.assemble_frame(place, order_of(TaskKind.ASSEMBLE), monitor)
    assert monitor.seen == sorted(monitor.seen)
    assert monitor.progress == 1.0


def test_a_tile_of_another_size_is_named(tmp_path: Path) -> None:
    place = job_with_tiles(tmp_path, "square", more_rows=1)
    with pytest.raises(ArtifactBroken, match=r"tiles/0001/00-00\.exr: expected 24 x 24 px, got 25 x 24"):
        assemble.assemble_frame(place, order_of(TaskKind.ASSEMBLE), NullMonitor())


class _Announced(NullMonitor):
    """Keeps the progress at which the end was announced."""

    def __init__(self) -> None:
        self.at: list[float] = []

    def announce_end(self) -> None:
        self.at.append(self.progress)


def test_the_end_of_an_assembly_is_announced_once_when_little_is_left(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = []
    for soon_px in (masters.SOON_PX, 9000):
        monkeypatch.setattr(masters, "SOON_PX", soon_px)
        monitor = _Announced()
        place = job_with_tiles(tmp_path / str(soon_px), "square")
        assemble.assemble_frame(place, order_of(TaskKind.ASSEMBLE), monitor)
        found += monitor.at
    assert found[0] == 0.0, "a small frame is assembled while the next POV-Ray starts"
    assert 0.3 < found[1] < 1.0
    assert len(found) == 2
