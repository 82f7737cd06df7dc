"""The main job as a user does it: up, submit, watch, fetch; then everything is looked at by other programs."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import av
import numpy as np
import pytest

from service.schemas.job import Job
from tests.farm import LIPPMANN, Farm, ended, farm_up
from tests.pictures import read_png

JOB = {
    "scene": "fish",
    "frames": "1-2",
    "rig": {"lens_array": {"count": [30, 30], "pitch_mm": 3.0, "focal_length_mm": 9.9}, "px_per_lens": 4},
}


@pytest.fixture(scope="module")
def farm(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Farm]:
    with farm_up(tmp_path_factory.mktemp("farm") / "data") as up:
        yield up


@pytest.fixture(scope="module")
def out(farm: Farm, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What `lippmann submit --watch` and `lippmann fetch` leave."""
    folder = tmp_path_factory.mktemp("out")
    (folder / "job.json").write_text(json.dumps(JOB))
    job_id = said(farm, "submit", str(folder / "job.json"))["id"]
    ended(farm.client, job_id)
    said(farm, "fetch", job_id, "--out", str(folder))
    return folder


def said(farm: Farm, *words: str) -> dict[str, Any]:
    ran = subprocess.run(
        [LIPPMANN, *words, "--json", "--data-dir", str(farm.data_dir)], capture_output=True, text=True, check=False
    )
    assert ran.returncode == 0, ran.stderr
    answer: dict[str, Any] = json.loads(ran.stdout)
    return answer


@pytest.mark.parametrize("kind", ["integral", "orthoscopic", "views"])
def test_every_frame_is_a_picture(out: Path, kind: str) -> None:
    pictures = [read_png(out / kind / f"{frame:04d}.png") for frame in (1, 2)]
    assert all(picture.shape == (120, 120, 3) for picture in pictures)
    assert (pictures[0] != pictures[1]).mean() > 0.05, "the fish turns"


def test_views_show_parallax_and_the_fish_in_front(out: Path) -> None:
    """From the left to the right eye the picture changes."""
    grid = read_png(out / "views" / "0001.png").astype(int)
    left, right = grid[30:60, :30], grid[30:60, 90:]
    assert np.abs(left - right).mean() > 5


@pytest.mark.parametrize(
    ("name", "count", "size", "fps"),
    [("views.mp4", 32, 720, 24), ("centre.mp4", 2, 720, 8), ("orthoscopic.mkv", 2, 120, 8)],
)
def test_the_videos_play(out: Path, name: str, count: int, size: int, fps: int) -> None:
    with av.open(str(out / "video" / name)) as video:
        stream = video.streams.video[0]
        assert (stream.width, stream.height, float(stream.average_rate or 0)) == (size, size, fps)
        assert sum(1 for _ in video.decode(stream)) == count


def test_the_lossless_video_is_the_orthoscopic_pictures(out: Path) -> None:
    with av.open(str(out / "video" / "orthoscopic.mkv")) as video:
        frames = [frame.to_ndarray(format="rgb24") for frame in video.decode(video=0)]
    for number, frame in enumerate(frames, start=1):
        assert (frame == read_png(out / "orthoscopic" / f"{number:04d}.png")).all()


def broken(farm: Farm, scene: str, text: str, tmp_path: Path) -> Job:
    """Upload a scene, submit a job of it, and return the job when it has ended."""
    folder = tmp_path / scene
    folder.mkdir()
    (folder / "scene.inc").write_text(text)
    (folder / "scene.toml").write_text(
        'title = "Broken"\n[stage]\nlocation = [0, 0, -1000]\nlook_at = [0, 0, 0]\n'
        "reference_mm = 1000\nnear_mm = 900\nfar_mm = 2000\n"
    )
    said(farm, "scenes", "upload", str(folder))
    return ended(farm.client, farm.client.submit({"scene": scene}).id)


def test_a_scene_that_does_not_parse_fails_the_job_with_povrays_own_words(farm: Farm, tmp_path: Path) -> None:
    job = broken(farm, "broken-sphere", "// one\nsphere { 0, 1 pigment { rgb nonsense } }\n", tmp_path)
    assert job.status == "failed"
    assert job.error is not None
    assert "scene.inc" in job.error.message
    assert "line 2" in job.error.message or ":2" in job.error.message
    assert "nonsense" in job.error.message


def test_a_missing_texture_is_named(farm: Farm, tmp_path: Path) -> None:
    job = broken(farm, "no-texture", 'sphere { 0, 1 pigment { image_map { png "skin.png" } } }\n', tmp_path)
    assert job.error is not None
    assert "skin.png" in job.error.message


def test_the_farm_is_well_after_all_that(farm: Farm) -> None:
    assert farm.client.health().status == "ok"
