"""Which files of a job are fetched."""

from __future__ import annotations

import errno
import fcntl
import json
import os
import shutil
import threading
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from lippmann.client import Refused, fetch_record
from lippmann.client.fetch import fetch_job
from lippmann.client.fetch_record import LOCK, RECORD, Fetched, FetchRecord, _delete_files, check_folder
from lippmann.client.missing import Why
from lippmann.errors import BadInput
from lippmann.job.spec import parse_spec
from lippmann.job.states import FrameStatus, JobStatus, TaskStatus
from tests.waiting import ENOUGH_S

FILES = (
    "depth/0001.exr",
    "depth/0002.exr",
    "depth-tiles/0001/00-00.exr",
    "orthoscopic/0001.exr",
    "orthoscopic/0002.exr",
)


class Service:
    """A service with the files of one job; Ctrl-C comes while one of them does."""

    def __init__(self, files: Sequence[str] = FILES, *, interrupted_at: str | None = None) -> None:
        self.files, self.interrupted_at = files, interrupted_at
        self.asked: list[str] = []
        self.at_once, self.most_at_once = 0, 0
        self.meeting: threading.Barrier | None = None
        self.outputs: list[Any] = []

    def job(self, job_id: str) -> Any:
        spec = parse_spec({"scene": "fish", "frames": "1-2", "outputs": self.outputs})
        return SimpleNamespace(id=job_id, spec=spec, status=JobStatus.DONE, error=None)

    def frames(self, job_id: str) -> Iterator[Any]:
        yield from (SimpleNamespace(frame=frame, status=FrameStatus.DONE) for frame in (1, 2))

    def tasks(self, job_id: str, **what: Any) -> Iterator[Any]:
        yield from ()

    def artifacts(self, job_id: str, *, prefix: str) -> Iterator[Any]:
        yield from (SimpleNamespace(name=name, etag="e", size=1) for name in self.files if name.startswith(prefix))

    def download(self, job_id: str, name: str, path: Path, **how: Any) -> Any:
        self.asked.append(name)
        self.at_once += 1
        self.most_at_once = max(self.most_at_once, self.at_once)
        if name == self.interrupted_at:
            raise KeyboardInterrupt
        if self.meeting is not None:
            self.meeting.wait(ENOUGH_S)
        self.at_once -= 1
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(f"{how['format']}")
        return SimpleNamespace(size=path.stat().st_size)


@pytest.mark.parametrize(
    ("masters", "expected"),
    [(False, {"orthoscopic/0002.png"}), (True, {"orthoscopic/0002.exr", "depth/0002.exr"})],
)
def test_depth_comes_with_the_masters_and_never_as_a_picture(tmp_path: Path, masters: bool, expected: set[str]) -> None:
    service: Any = Service()
    fetched = fetch_job(service, "j", tmp_path, frames="2", masters=masters)
    assert {str(path.relative_to(tmp_path)) for path in fetched.files} == expected
    assert all(path.read_text() == ("None" if masters else "png") for path in fetched.files)


EXPORTS = tuple(f"exports/npz/{frame:04d}.npz" for frame in range(1, 301))


@pytest.mark.parametrize("parallel", [1, 4])
def test_a_fetch_that_was_interrupted_brings_only_what_is_missing(tmp_path: Path, parallel: int) -> None:
    service: Any = Service(EXPORTS, interrupted_at=EXPORTS[200])
    with pytest.raises(KeyboardInterrupt):
        fetch_job(service, "j", tmp_path, parallel=parallel)
    assert 200 < len(service.asked) < len(EXPORTS)
    again: Any = Service(EXPORTS)
    assert fetch_job(again, "j", tmp_path).fetched == len(EXPORTS) - len(service.asked) + 1
    assert sorted(again.asked) == sorted({*EXPORTS} - {*service.asked} | {EXPORTS[200]})
    assert fetch_job(again, "j", tmp_path).fetched == 0


def test_as_many_files_are_fetched_at_the_same_time_as_the_caller_says(tmp_path: Path) -> None:
    service: Any = Service(EXPORTS)
    service.meeting = threading.Barrier(3)  # It lets three downloads pass when three have come.
    assert fetch_job(service, "j", tmp_path, parallel=3).fetched == 300
    assert service.most_at_once == 3


def test_ctrl_c_ends_the_pauses_of_downloads_that_are_tried_again(tmp_path: Path) -> None:
    service: Any = Service(EXPORTS[:4])
    pausing = threading.Barrier(4)
    ended: list[str] = []

    def download(job_id: str, name: str, path: Path, **how: Any) -> Any:
        pausing.wait(ENOUGH_S)
        if name == EXPORTS[0]:
            raise KeyboardInterrupt
        sleep = how["sleep"]
        try:
            sleep(10 * ENOUGH_S)
        finally:
            ended.append(name)
        raise AssertionError("the pause ended without Ctrl-C")

    service.download = download
    began_s = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        fetch_job(service, "j", tmp_path, parallel=4)
    assert sorted(ended) == sorted(EXPORTS[1:4])
    assert time.monotonic() - began_s < ENOUGH_S


def test_what_a_fetch_writes_down_grows_with_its_files_and_not_with_their_square(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    written: list[int] = []
    really = fetch_record.write_record

    def counted(record: FetchRecord) -> None:
        written.append(len(record.known))
        really(record)

    monkeypatch.setattr(fetch_record, "write_record", counted)
    service: Any = Service(EXPORTS)
    fetch_job(service, "j", tmp_path)
    assert 1 <= len(written) < 10
    assert len(json.loads((tmp_path / RECORD).read_bytes())["files"]) == len(EXPORTS)


def test_a_folder_belongs_to_one_job(tmp_path: Path) -> None:
    service: Any = Service()
    fetch_job(service, "one", tmp_path)
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(
        BadInput, match=r"expected a new folder or the one of job two, got .* with the files of job one"
    ):
        fetch_job(service, "two", tmp_path)
    assert sorted(tmp_path.rglob("*")) == before
    assert fetch_job(service, "one", tmp_path, masters=True).fetched == 4


@pytest.mark.parametrize("has_just_ended", [False, True])
def test_one_fetch_at_a_time_writes_to_a_folder(
    tmp_path: Path, has_just_ended: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A fetch that has just ended has removed the file that another one has opened to lock it."""
    really_locked = fcntl.flock
    ended = [has_just_ended]

    def flock(descriptor: int, how: int) -> None:
        if ended.pop(0) if ended else False:
            (tmp_path / LOCK).unlink()
        really_locked(descriptor, how)

    monkeypatch.setattr(fcntl, "flock", flock)
    first: Any = Service()
    second: Any = Service()
    refused: list[str] = []
    really = first.download

    def download(*what: Any, **how: Any) -> Any:
        with pytest.raises(
            BadInput, match=r"--out: expected a folder that no other fetch uses, got .*, to which one"
        ) as said:
            fetch_job(second, "one", tmp_path)
        refused.append(said.value.message)
        return really(*what, **how)

    first.download = download
    assert fetch_job(first, "one", tmp_path).fetched == len(refused) == 2
    assert second.asked == []
    assert not (tmp_path / LOCK).exists()
    assert fetch_job(second, "one", tmp_path).fetched == 0


def test_a_folder_on_a_disk_without_locks_is_written_to(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def no_locks(descriptor: int, how: int) -> None:
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr(fcntl, "flock", no_locks)
    service: Any = Service()
    assert fetch_job(service, "one", tmp_path).fetched == 2


def test_a_folder_with_pictures_that_no_fetch_has_brought_is_refused(tmp_path: Path) -> None:
    (tmp_path / "integral").mkdir()
    (tmp_path / "notes.txt").write_text("mine")
    service: Any = Service()
    with pytest.raises(BadInput, match=r"with integral/, which no fetch has brought"):
        fetch_job(service, "j", tmp_path)
    (tmp_path / "integral").rmdir()
    assert fetch_job(service, "j", tmp_path).fetched == 2


@pytest.mark.parametrize("record", ["", "{", "[]", "{}", '{"files": 7}', '{"job": null, "files": {}}'])
def test_a_folder_whose_record_is_damaged_is_refused_lest_two_jobs_are_mixed(tmp_path: Path, record: str) -> None:
    service: Any = Service()
    fetch_job(service, "one", tmp_path)
    (tmp_path / RECORD).write_text(record)
    for job_id in ("one", "two"):
        with pytest.raises(BadInput, match=r"with orthoscopic/, whose record \.fetched\.json cannot be read"):
            fetch_job(service, job_id, tmp_path)
    assert (tmp_path / RECORD).read_text() == record
    shutil.rmtree(tmp_path / "orthoscopic")
    assert fetch_job(service, "two", tmp_path).fetched == 2


def test_the_record_is_on_the_disk_before_it_has_its_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    written: list[tuple[int, bool]] = []

    def fsync(descriptor: int) -> None:
        written.append((os.fstat(descriptor).st_size, (tmp_path / RECORD).exists()))

    monkeypatch.setattr(os, "fsync", fsync)
    fetch_record.write_record(FetchRecord(tmp_path, "one", is_demo=False, known={}))
    assert written == [((tmp_path / RECORD).stat().st_size, False)]


def test_the_record_of_an_earlier_release_is_that_of_the_job_whose_files_it_names(tmp_path: Path) -> None:
    service: Any = Service()
    fetch_job(service, "j", tmp_path)
    files = json.loads((tmp_path / RECORD).read_bytes())["files"]
    (tmp_path / RECORD).write_text(json.dumps(files))
    with pytest.raises(BadInput, match="with the files of a job that an earlier release has fetched"):
        check_folder(tmp_path, job_id=None, is_demo=True)
    assert fetch_job(service, "j", tmp_path, masters=True).fetched == 4  # Another selection is of the same job.
    (tmp_path / RECORD).write_text(json.dumps(files))
    assert fetch_job(service, "j", tmp_path).fetched == 0
    (tmp_path / RECORD).write_text(json.dumps({name: one | {"etag": "other"} for name, one in files.items()}))
    with pytest.raises(BadInput, match="with the files of another job"):
        fetch_job(service, "j", tmp_path)


def test_a_demo_replaces_the_files_of_the_demo_before_and_no_others(tmp_path: Path) -> None:
    first: Any = Service(("orthoscopic/0001.exr", "exports/npz/0001.npz"))
    fetch_job(first, "one", tmp_path, is_demo=True)
    (tmp_path / "notes.txt").write_text("mine")
    second: Any = Service(("orthoscopic/0002.exr",))
    fetch_job(second, "two", tmp_path, is_demo=True)
    names = {str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*") if path.is_file()}
    assert names == {"orthoscopic/0002.png", "notes.txt", RECORD, "missing.json"}
    with pytest.raises(BadInput, match="the files of job two"):
        fetch_job(second, "three", tmp_path)


def test_a_further_fetch_of_a_demo_leaves_its_folder_to_the_next_demo(tmp_path: Path) -> None:
    service: Any = Service()
    fetch_job(service, "one", tmp_path, is_demo=True)
    fetch_job(service, "one", tmp_path, masters=True)
    check_folder(tmp_path, job_id=None, is_demo=True)
    with pytest.raises(BadInput, match="the files of job one"):
        check_folder(tmp_path, job_id=None)


def test_a_file_that_has_changed_since_it_was_fetched_keeps_the_next_demo_out(tmp_path: Path) -> None:
    service: Any = Service()
    fetch_job(service, "one", tmp_path, is_demo=True)
    own = tmp_path / "orthoscopic" / "0002.png"
    fetched = own.read_text()
    own.unlink()
    own.write_text(fetched.swapcase())  # of the same size, as frames of one capture are
    os.utime(own, ns=(0, 1))
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(BadInput, match=r"with orthoscopic/0002\.png, which has changed since it was fetched"):
        fetch_job(service, "two", tmp_path, is_demo=True)
    assert sorted(tmp_path.rglob("*")) == before
    assert own.read_text() == fetched.swapcase()
    own.unlink()
    assert fetch_job(service, "two", tmp_path, is_demo=True).fetched == 2


def test_only_files_that_are_as_they_were_fetched_are_deleted(tmp_path: Path) -> None:
    files = {}
    for name, mtime_ns in (("same", 1), ("later", 2), ("longer", 1)):
        (tmp_path / name).write_text(name)
        os.utime(tmp_path / name, ns=(1, 1))
        files[name] = Fetched(Path(name), "e", 4 if name != "later" else 5, mtime_ns)
    _delete_files(FetchRecord(tmp_path, "one", is_demo=True, known=files))
    assert sorted(path.name for path in tmp_path.iterdir()) == ["later", "longer"]


def test_frames_beyond_the_job_and_unknown_outputs_are_refused_by_name(tmp_path: Path) -> None:
    service: Any = Service()
    with pytest.raises(BadInput, match=r"--frames: expected frames of the job, which are 1-2, got 3-4, 9"):
        fetch_job(service, "j", tmp_path, frames="2-4,9")
    with pytest.raises(BadInput, match="--outputs: expected none, because the job has no outputs, got 'x'"):
        fetch_job(service, "j", tmp_path, outputs=["x"])
    service.outputs = ["views.mp4", "view_grid.png"]
    with pytest.raises(
        BadInput, match=r"expected one of views.mp4, view_grid.png, got 'view.mp4' \(did you mean views"
    ):
        fetch_job(service, "j", tmp_path, outputs=["view.mp4"])
    assert service.asked == []
    assert not list(tmp_path.iterdir())


def test_chosen_outputs_come_alone_and_with_the_pictures_of_frames(tmp_path: Path) -> None:
    grid = ("exports/view_grid.png.json", "exports/view_grid/0001.png")
    service: Any = Service((*FILES, *grid, "video/views.mp4"))
    service.outputs = ["views.mp4", "view_grid.png"]
    result = fetch_job(service, "j", tmp_path, outputs=["view_grid.png"])
    assert sorted(service.asked) == sorted(grid)
    assert not result.missing
    fetch_job(service, "j", tmp_path, outputs=["views.mp4"], frames="2")
    assert sorted(service.asked) == sorted((*grid, "video/views.mp4", "orthoscopic/0002.exr"))


@pytest.mark.parametrize(
    ("code", "why"), [("artifact-repairing", Why.RUNNING), ("artifact-broken", Why.DAMAGED)], ids=str
)
def test_a_damaged_file_prevents_no_other_also_while_the_farm_makes_it_again(
    tmp_path: Path, code: str, why: Why
) -> None:
    service: Any = Service((*FILES, "video/views.mp4"))
    service.outputs = ["views.mp4"]
    made = SimpleNamespace(output="views.mp4", status=TaskStatus.DONE, error=None)
    service.tasks = lambda job_id, **what: iter([made])
    really = service.download

    def download(job_id: str, name: str, path: Path, **how: Any) -> Any:
        if name in ("orthoscopic/0001.exr", "video/views.mp4"):
            raise Refused(f"{name} is damaged", status=503, code=code)
        return really(job_id, name, path, **how)

    service.download = download
    result = fetch_job(service, "j", tmp_path, parallel=1)
    assert [path.name for path in result.files] == ["0002.png"]
    first, _ = result.missing.frames
    (video,) = result.missing.outputs
    assert (first.frame, first.why, first.error) == (1, why, "orthoscopic/0001.exr is damaged")
    assert (video.output, video.why, video.error) == ("views.mp4", why, "video/views.mp4 is damaged")


@pytest.mark.parametrize("name", ["../x", "exports/../../x", "/tmp/x", ""])
def test_no_name_that_a_service_says_leads_out_of_the_folder(tmp_path: Path, name: str) -> None:
    service: Any = Service()
    service.artifacts = lambda job_id, *, prefix: iter([SimpleNamespace(name=name, etag="e", size=1)])
    # Of masters only EXR files are wanted: what is in the folders of outputs comes whatever it is called.
    with pytest.raises(BadInput, match="expected files below the job"):
        fetch_job(service, "j", tmp_path / "out")
    assert service.asked == []
