"""Which files of a job are fetched."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from lippmann.client import fetch as fetching
from lippmann.client.fetch import RECORD, fetch_job
from lippmann.errors import BadInput
from lippmann.job.spec import parse_spec
from lippmann.job.states import FrameStatus, JobStatus

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

    def job(self, job_id: str) -> Any:
        spec = parse_spec({"scene": "fish", "frames": "1-2", "outputs": []})
        return SimpleNamespace(id=job_id, spec=spec, status=JobStatus.DONE, error=None)

    def frames(self, job_id: str) -> Iterator[Any]:
        yield from (SimpleNamespace(frame=frame, status=FrameStatus.DONE) for frame in (1, 2))

    def tasks(self, job_id: str, **what: Any) -> Iterator[Any]:
        yield from ()

    def artifacts(self, job_id: str, *, prefix: str) -> Iterator[Any]:
        yield from (SimpleNamespace(name=name, etag="e", size=1) for name in self.files if name.startswith(prefix))

    def download(self, job_id: str, name: str, path: Path, **how: Any) -> Any:
        self.asked.append(name)
        if name == self.interrupted_at:
            raise KeyboardInterrupt
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


def test_a_fetch_that_was_interrupted_brings_only_what_is_missing(tmp_path: Path) -> None:
    service: Any = Service(EXPORTS, interrupted_at=EXPORTS[200])
    with pytest.raises(KeyboardInterrupt):
        fetch_job(service, "j", tmp_path)
    again: Any = Service(EXPORTS)
    assert fetch_job(again, "j", tmp_path).fetched == 100
    assert again.asked == list(EXPORTS[200:])
    assert fetch_job(again, "j", tmp_path).fetched == 0


def test_what_a_fetch_writes_down_grows_with_its_files_and_not_with_their_square(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    written: list[int] = []
    really = fetching._write_record

    def counted(folder: Path, known: Mapping[str, fetching.Fetched]) -> None:
        written.append(len(known))
        really(folder, known)

    monkeypatch.setattr(fetching, "_write_record", counted)
    service: Any = Service(EXPORTS)
    fetch_job(service, "j", tmp_path)
    assert 1 <= len(written) < 10
    assert len(json.loads((tmp_path / RECORD).read_bytes())) == len(EXPORTS)


@pytest.mark.parametrize("name", ["../x", "exports/../../x", "/tmp/x", ""])
def test_no_name_that_a_service_says_leads_out_of_the_folder(tmp_path: Path, name: str) -> None:
    service: Any = Service()
    service.artifacts = lambda job_id, *, prefix: iter([SimpleNamespace(name=name, etag="e", size=1)])
    # Of masters only EXR files are wanted: what is in the folders of outputs comes whatever it is called.
    with pytest.raises(BadInput, match="expected files below the job"):
        fetch_job(service, "j", tmp_path / "out")
    assert service.asked == []
