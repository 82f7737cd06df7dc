"""Outputs of masters that are on disk: the same as a job's, and what cannot be is named."""

from __future__ import annotations

import errno
import json
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from lippmann.errors import ArtifactBroken, BadInput, SpecError
from lippmann.job.rendering.channels import channel_attributes
from lippmann.local.files.frame_source import files_frames
from lippmann.local.files.master import named_rig
from lippmann.local.pictures.export import export_outputs, parse_outputs
from lippmann.plan import artifact_names as names
from lippmann.plan.sampling import display_size
from tests.builders_outputs import GivenJob, given_job
from worker.images.foreign import decoder
from worker.images.write import write_channels


@pytest.fixture
def job(tmp_path: Path) -> GivenJob:
    return given_job(tmp_path / "job", frames="1-3", outputs=["quilt.png", "centre.mkv", "view_grid.png"], fps=8)


@pytest.fixture
def masters(tmp_path: Path, job: GivenJob) -> Path:
    """The job's masters as `fetch --masters` leaves them."""
    folder = tmp_path / "fetched"
    for frame in job.sheet.spec.frame_numbers:
        path = folder / names.orthoscopic_name(frame)
        path.parent.mkdir(parents=True, exist_ok=True)
        with job.file(names.orthoscopic_name(frame)) as master:
            path.write_bytes(master.read_bytes())
    return folder


def test_what_is_made_here_is_what_the_job_makes(job: GivenJob, masters: Path, tmp_path: Path) -> None:
    source = files_frames(masters, fps=8.0)
    written = ["quilt.png", '{"kind": "centre", "codec": "ffv1"}', "view_grid.png"]
    made = export_outputs(source, parse_outputs(written, source), tmp_path / "out")
    assert [one.output for one in made] == ["quilt.png", "centre.mkv", "view_grid.png"]
    for one in made:
        assert one.error is None
        job.make(one.output)
        said = json.loads(one.files[0].read_text())
        theirs = job.sidecar(one.output)
        assert said["files"] == theirs["files"]
        assert said["integral_image"] == theirs["integral_image"]
        for name in said["files"]:
            with job.file(name) as theirs_path:
                assert (tmp_path / "out" / name).read_bytes() == theirs_path.read_bytes()


def test_of_one_master_or_of_some_frames_only_these_are_made(masters: Path, tmp_path: Path) -> None:
    one = files_frames(masters / "orthoscopic/0002.exr", fps=8.0)
    assert one.frames == (2,)
    some = files_frames(masters, frames="2-3", fps=8.0)
    (made,) = export_outputs(some, parse_outputs(["view_grid.png"], some), tmp_path)
    assert [path.name for path in made.files[1:]] == ["0002.png", "0003.png"]


def test_an_output_that_cannot_be_made_keeps_no_other_from_being_made(masters: Path, tmp_path: Path) -> None:
    whole = (masters / "orthoscopic/0003.exr").read_bytes()
    source = files_frames(masters, fps=8.0)
    (masters / "orthoscopic/0003.exr").write_bytes(whole[: len(whole) // 2])
    outputs = parse_outputs(["centre.mkv", "quilt.png"], source)
    broken, also_broken = export_outputs(source, outputs, tmp_path / "out")
    assert "0003.exr" in (broken.error or "")
    assert also_broken.error
    assert not (tmp_path / "out/video/centre.mkv").exists()
    (masters / "orthoscopic/0003.exr").write_bytes(whole)
    assert all(one.error is None for one in export_outputs(source, outputs, tmp_path / "out"))
    (masters / "orthoscopic/0003.exr").write_bytes(whole[: len(whole) // 2])
    assert all(one.error for one in export_outputs(source, outputs, tmp_path / "out"))
    assert not (tmp_path / "out/exports/quilt.png.json").exists(), "it told of files of the export before"


def test_a_place_that_cannot_be_written_keeps_no_other_output_from_being_made(masters: Path, tmp_path: Path) -> None:
    source = files_frames(masters, fps=8.0)
    (tmp_path / "exports").mkdir()
    (tmp_path / "exports/quilt").write_text("a file where the folder of the quilts would be")
    written = parse_outputs(["quilt.png", "view_grid.png"], source)
    quilt, grid = export_outputs(source, written, tmp_path)
    assert "exports/quilt" in (quilt.error or "")
    assert (quilt.files, grid.error, len(grid.files)) == ((), None, 4)


def test_what_a_full_disk_cuts_short_is_not_there(
    masters: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def is_full(*_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    source = files_frames(masters, fps=8.0)
    monkeypatch.setattr("lippmann.local.pictures.export.shutil.copyfileobj", is_full)
    (made,) = export_outputs(source, parse_outputs(["centre.mkv"], source), tmp_path / "out")
    assert "No space left on device" in (made.error or "")
    assert [path.name for path in (tmp_path / "out").rglob("*") if path.is_file()] == []


@pytest.mark.parametrize(
    ("written", "words"),
    [
        (["quilt.gif"], r"^outputs\.0: expected an object with a kind, or one of .*'quilt\.png'.*, got 'quilt.gif'"),
        (["quilt.png", "quilt.png"], r"outputs\.1\.name: expected a name of its own"),
        (['{"kind": "views", "codec": "divx"}'], r"codec: expected .*, got 'divx'"),
        (['{"kind": '], "expected an output as a file name or as JSON"),
        (['{"kind": "hci", "disparity": "truth"}'], r"capture\.depth"),
    ],
)
def test_what_is_no_output_is_named(written: list[str], words: str, masters: Path) -> None:
    source = files_frames(masters, fps=8.0)
    with pytest.raises((BadInput, SpecError), match=words):
        parse_outputs(written, source)


@pytest.mark.promise("Scenes", "`lippmann export` decodes masters and depths in the sandbox, never in its own process.")
def test_masters_that_others_made_are_decoded_in_the_sandbox(
    masters: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (masters / "depth").mkdir()
    (masters / "channels").mkdir()
    for frame in (1, 2, 3):
        shutil.copyfile(masters / names.orthoscopic_name(frame), masters / names.depth_name(frame))
        rig = named_rig(masters / names.orthoscopic_name(frame))
        size = display_size(rig).rows, display_size(rig).cols
        said = channel_attributes(("object",) if frame == 2 else ("normal", "object"), ("fish",))
        write_channels(
            masters / names.channels_name(frame), [np.ones((*size, 1), np.float32)], ["object.id"], size=size,
            attributes=said,
        )  # fmt: skip
    source = files_frames(masters, fps=8.0)
    assert source.channels == ("object",), "what all frames have"
    assert source.objects(1) == ("fish",)
    assert (source.channel(1, "object") == 1).all()
    evil = tmp_path / "evil.py"
    evil.write_text("print('half')\n")
    monkeypatch.setattr(decoder, "__file__", str(evil))
    reads: tuple[Callable[[], object], ...] = (
        lambda: source.image(1),
        lambda: source.orthoscopic_rows(1).__enter__(),
        lambda: source.depth(1),
        lambda: source.channel(1, "object"),
    )
    for read in reads:
        with pytest.raises(ArtifactBroken, match=r"0001\.exr: expected numbers from the decoder, got no file"):
            read()
    (made,) = export_outputs(source, parse_outputs(['{"kind": "spoc", "distance_mm": 5}'], source), tmp_path / "out")
    assert "expected numbers from the decoder" in (made.error or "")


def test_what_are_no_masters_is_named(masters: Path, tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="expected orthoscopic masters"):
        files_frames(tmp_path / "job" / "nothing", fps=8.0)
    with pytest.raises(BadInput, match=r"--frames: expected some of 1, 2, 3 in .*, got 7"):
        files_frames(masters, frames="2,7", fps=8.0)
    (masters / "orthoscopic").rename(masters / "views")
    with pytest.raises(BadInput, match=r"as orthoscopic/0001\.exr, got"):
        files_frames(masters / "views", fps=8.0)
