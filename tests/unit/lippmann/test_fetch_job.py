"""Which files of a job are fetched."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from lippmann.fetch_job import fetch_job

FILES = (
    "depth/0001.exr",
    "depth/0002.exr",
    "depth-tiles/0001/00-00.exr",
    "orthoscopic/0001.exr",
    "orthoscopic/0002.exr",
)


class Service:
    """A service with the files of one job."""

    def artifacts(self, job_id: str, *, prefix: str) -> Iterator[Any]:
        yield from (SimpleNamespace(name=name, etag="e", size=1) for name in FILES if name.startswith(prefix))

    def download(self, job_id: str, name: str, path: Path, **how: Any) -> Any:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(f"{how['format']}")
        return SimpleNamespace(size=path.stat().st_size)


@pytest.mark.parametrize(
    ("masters", "expected"),
    [(False, {"orthoscopic/0002.png"}), (True, {"orthoscopic/0002.exr", "depth/0002.exr"})],
)
def test_depth_comes_with_the_masters_and_never_as_a_picture(tmp_path: Path, masters: bool, expected: set[str]) -> None:
    service: Any = Service()
    haul = fetch_job(service, "j", tmp_path, frames="2", masters=masters)
    assert {str(path.relative_to(tmp_path)) for path in haul.files} == expected
    assert all(path.read_text() == ("None" if masters else "png") for path in haul.files)
