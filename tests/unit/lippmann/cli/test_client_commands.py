"""The commands ask the client for what their options say."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from lippmann.cli import main
from lippmann.client import Client
from lippmann.errors import BadInput
from povtemplates.catalogue import scene_folders

AT = ("--url", "http://127.0.0.1:1", "--key", "key")


class Asked(Exception):
    """The client was asked for this."""


def _asked(*what: Any, **how: Any) -> Any:
    raise Asked(*what, *how.values())


@pytest.mark.parametrize(
    ("bundle", "options", "expected"),
    [
        ("my", (), "my"),
        ("my.v2", (), "my.v2"),
        ("my.v2.zip", (), "my.v2"),
        ("my", ("--name", "mine"), "mine"),
        ("my", ("--name", ""), ""),
    ],
)
def test_a_scene_has_the_whole_name_of_its_folder(
    bundle: str, options: tuple[str, ...], expected: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without its end, `my.v2` would replace `my`; a name that cannot be is refused by the service."""
    monkeypatch.setattr(Client, "upload_scene", lambda self, name, data: _asked(name))
    if bundle.endswith(".zip"):
        shutil.make_archive(str(tmp_path / bundle.removesuffix(".zip")), "zip", scene_folders()["target-white"])
    else:
        shutil.copytree(scene_folders()["target-white"], tmp_path / bundle)
    ran = CliRunner().invoke(main.app, ["scenes", "upload", str(tmp_path / bundle), *options, *AT])
    assert isinstance(ran.exception, Asked)
    assert ran.exception.args == (expected,)


@pytest.mark.parametrize("arguments", [("skip", "job"), ("export", "job", "quilt.png")])
@pytest.mark.parametrize("frames", ["", " "])
def test_an_empty_variable_of_the_shell_names_no_frames(
    arguments: tuple[str, ...], frames: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    for method in ("skip", "job"):
        monkeypatch.setattr(Client, method, _asked)
    ran = CliRunner().invoke(main.app, [*arguments, "--frames", frames, *AT])
    assert isinstance(ran.exception, BadInput)
    assert ran.exception.message == f"--frames: expected frames such as 1-48:2,60, got {frames!r}"


@pytest.mark.parametrize(("options", "expected"), [((), None), (("--frames", "7,2-4"), (2, 3, 4, 7))])
def test_the_frames_to_skip_are_those_of_the_option(
    options: tuple[str, ...], expected: tuple[int, ...] | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Client, "skip", lambda self, job_id, frames: _asked(job_id, frames))
    ran = CliRunner().invoke(main.app, ["skip", "job", *options, *AT])
    assert isinstance(ran.exception, Asked)
    assert ran.exception.args == ("job", expected)
