"""What is said of videos that are not whole."""

from __future__ import annotations

from pathlib import Path

import pytest

from lippmann.errors import ArtifactBroken, ArtifactMissing
from tests.unit.worker.video.movies import noise
from worker.video.encode import encode
from worker.video.kinds import H264
from worker.video.read import read_frames


def test_what_is_not_there_is_missing(tmp_path: Path) -> None:
    with pytest.raises(ArtifactMissing, match="got no file"):
        next(read_frames(tmp_path / "none.mkv"))


def test_what_is_no_video_is_broken(tmp_path: Path) -> None:
    (tmp_path / "a.mkv").write_bytes(b"once upon a time")
    with pytest.raises(ArtifactBroken, match=r"a\.mkv: Invalid data"):
        next(read_frames(tmp_path / "a.mkv"))


@pytest.mark.parametrize("kept", [20, 200, 600])
def test_an_index_cut_short_is_broken(tmp_path: Path, kept: int) -> None:
    path = tmp_path / "a.mp4"
    encode(path, noise(4, 64, 64), kind=H264, fps=8)
    path.write_bytes(path.read_bytes()[:kept])
    with pytest.raises(ArtifactBroken, match=r"a\.mp4: "):
        list(read_frames(path))
