"""Integral images from elsewhere through the farm: uploaded as a scene is, and nothing rendered."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from typer.testing import CliRunner

from lippmann.cli.main import app
from lippmann.client.fetch import fetch_job
from lippmann.job.messages.orders import TaskKind
from lippmann.lightfield.sheet.lens_grid import LensGrid
from lippmann.local.files.bundle import read_bundle
from service.schemas.job import Job
from tests.farm import Farm, ended, farm_up
from tests.pictures import read_png
from tests.unit.lippmann.lightfield.lens_pictures import white_image

GRID = LensGrid(1, 1, pitch_px=9.3, offset_px=(6.1, 7.7), turn_deg=-1.1)
SIZE = (150, 180)


@pytest.fixture(scope="module")
def farm(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Farm]:
    with farm_up(tmp_path_factory.mktemp("farm") / "data") as up:
        yield up


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with what the command made of two pictures, and their bundle."""
    folder = tmp_path_factory.mktemp("made")
    white = np.clip(white_image(GRID, SIZE, noise=0.0)[..., 0], 0, 1)
    Image.fromarray((white * 65535).astype(np.uint16)).save(folder / "white.png")
    for number, colour in enumerate(((255, 120, 30), (40, 160, 255)), start=1):
        picture = white[..., np.newaxis] * np.linspace(0.3, 1, SIZE[1])[:, np.newaxis] * colour
        Image.fromarray(picture.astype(np.uint8)).save(folder / f"{number}.png")
    words = ["views", str(folder / "1.png"), str(folder / "2.png"), "--find-from", str(folder / "white.png")]
    ran = CliRunner().invoke(app, [*words, "--out", str(folder / "here"), "--bundle", str(folder / "bundle")])
    assert ran.exit_code == 0, ran.output
    return folder


@pytest.fixture(scope="module")
def job(farm: Farm, made: Path) -> Job:
    farm.client.upload_scene("mine", read_bundle(made / "bundle"))
    asked = {"scene": "mine", "frames": "1-2", "outputs": ["views.mp4", "centre.mp4"]}
    return ended(farm.client, farm.client.submit(asked).id)


def test_it_is_done_without_a_tile(farm: Farm, job: Job) -> None:
    assert job.status == "done", job.error
    assert job.frames_done == 2
    assert job.spec.rig.imaging_lens is None
    assert job.notes == ("Integral images from elsewhere: nothing is rendered.",)
    kinds = {task.kind for task in farm.client.tasks(job.id)}
    assert kinds == {TaskKind.PROBE, TaskKind.ASSEMBLE, TaskKind.ENCODE}


def test_it_gives_what_the_command_gives_of_the_same_pictures(farm: Farm, job: Job, made: Path, tmp_path: Path) -> None:
    fetch_job(farm.client, job.id, tmp_path)
    for frame in ("0001", "0002"):
        for kind in ("orthoscopic", "views"):
            fetched, here = (read_png(folder / kind / f"{frame}.png") for folder in (tmp_path, made / "here"))
            assert fetched.shape == here.shape
            assert np.abs(fetched.astype(int) - here).max() <= 1
    assert (tmp_path / "video/views.mp4").is_file()


def test_a_frame_that_is_not_there_is_refused_before_anything_begins(farm: Farm, job: Job) -> None:
    with pytest.raises(Exception, match="frames 1 to 2, one for every picture"):
        farm.client.submit({"scene": job.scene, "frames": "3"})
