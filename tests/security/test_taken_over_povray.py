"""A POV-Ray that was taken over by a picture: what it leaves behind is neither followed nor published."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lippmann.errors import RenderFailed
from lippmann.job.messages.orders import TaskKind
from lippmann.plan import artifact_names as names
from tests.builders import local_place, order_of, small_job, stored_job, tiles_of
from tests.needs import needs_povray
from worker.images.write import write_exr
from worker.sandbox.sandbox import Sandbox
from worker.tasks.attempts.monitor import NullMonitor
from worker.tasks.attempts.workplace import Workplace
from worker.tasks.frames.render import render_tile
from worker.tasks.local import JOB_ID

SECRET = "the key of the administrator"

LINKS = """#!/usr/bin/perl
# Landlock refuses new processes, so that a shell could not call ln.
unlink "../lippmann-frame.pov";
symlink "{secret}", $_ for "../lippmann-frame.pov", "lippmann-frame.pov", "lippmann-picture.exr";
symlink "{outside}", $_ for "../tile.exr", "tile.exr";
exec "povray", @ARGV;
"""
BOMB = """#!/bin/bash
printf 'v/1\\x01\\x02\\0\\0\\0channels\\0chlist\\0\\xff\\xff\\xff\\xff' > lippmann-picture.exr
"""

COPY = """#!/usr/bin/perl
unlink "../lippmann-frame.pov";
symlink "{secret}", "lippmann-frame.pov";
symlink "{outside}", "tile.exr";
open my $copy, ">", "lippmann-picture.exr"; binmode $copy; print $copy pack "H*", "%s"; close $copy;
print STDERR "  Trace Time:       0 hours  0 minutes  1 seconds (1.000 seconds)\\n";
"""
"""The engine is replaced, and its picture is a whole one of another scene."""


@pytest.fixture
def place(tmp_path: Path, sandbox: Sandbox) -> Workplace:
    (tmp_path / "secret").write_text(SECRET)
    return replace(local_place(tmp_path / "data"), sandbox=sandbox)


def _render(place: Workplace, script: str, folder: Path) -> None:
    program = folder / "povray"
    program.write_text(script.format(secret=folder / "secret", outside=folder / "outside.exr"))
    program.chmod(0o755)
    spec = small_job("target-white", count=(4, 4), render={"cache": False})
    stored_job(place, spec)
    settings = place.settings.model_copy(update={"povray": str(program)})
    (tile,) = tiles_of(spec)
    render_tile(replace(place, settings=settings), order_of(TaskKind.RENDER, tile=tile), NullMonitor())


@pytest.mark.promise(
    "Scenes", "A POV-Ray that was taken over publishes no secret and writes nothing outside through links."
)
@needs_povray
def test_its_links_publish_no_secret_and_write_nothing_outside(place: Workplace, tmp_path: Path) -> None:
    _render(place, LINKS, tmp_path)
    text = names.job_artifact(JOB_ID, names.pov_name(1, tiles_of(small_job("target-white", count=(4, 4)))[0].index))
    assert place.store.get_bytes(text).startswith(b"//"), "the text is ours"
    assert not (tmp_path / "outside.exr").exists()
    published = [path for path in place.settings.artifacts_dir.rglob("*") if path.is_file()]
    assert published
    assert not any(SECRET.encode() in path.read_bytes() for path in published)
    assert list(place.settings.attempts_dir.iterdir()) == []


@pytest.mark.promise("Scenes", "A picture that POV-Ray did not make is refused before it is decoded.")
def test_a_picture_that_is_none_of_povrays_fails_the_task_before_it_is_decoded(
    place: Workplace, tmp_path: Path
) -> None:
    with pytest.raises(RenderFailed, match=r"lippmann-picture\.exr broken: an attribute of 4294967295 bytes"):
        _render(place, BOMB, tmp_path)
    assert list(place.settings.attempts_dir.iterdir()) == []


@pytest.mark.promise("Scenes", "A picture of another size or kind than was asked for is not taken.")
def test_a_whole_picture_of_another_size_in_the_place_of_povrays_fails_the_task(
    place: Workplace, tmp_path: Path
) -> None:
    write_exr(tmp_path / "pic.exr", np.zeros((4, 4, 3), np.float32), attributes={})
    picture = (tmp_path / "pic.exr").read_bytes().hex()
    with pytest.raises(RenderFailed, match=r"lippmann-picture\.exr broken: expected 33 x 32 px"):
        _render(place, COPY % picture, tmp_path)
    assert not (tmp_path / "outside.exr").exists()
    stored = [path for path in place.settings.artifacts_dir.rglob("*") if path.is_file()]
    assert not any(SECRET.encode() in path.read_bytes() for path in stored)
    assert list(place.settings.attempts_dir.iterdir()) == []
