"""Hints with an error of a scene: the picture that it is about, and the dialect of the scene."""

from __future__ import annotations

from pathlib import Path

import pytest

from worker.engines.povray.answers.hints import with_hint
from worker.engines.povray.answers.messages import Message, MessageKind
from worker.engines.povray.scenes.scene_files import SceneFiles

PNG = Message(MessageKind.ERROR, "Not a PNG file", "s.pov", 3)
WALL = (
    '#version 3.7;\nplane { z, 5 pigment { image_map { png\n  "Maps/WOOD.png" } } }\nsphere { 0, 1 } // "other.png"\n'
)


def hinted(folder: Path, message: Message, *, text: str = WALL, picture: bytes = b"") -> str:
    """Return a message with its hint, for a scene with a picture."""
    bundle = folder / "bundle"
    (bundle / "maps").mkdir(parents=True)
    (bundle / "maps" / "wood.png").write_bytes(picture)
    (bundle / "s.pov").write_text(text)
    return with_hint(message, SceneFiles(bundle, "s.pov")).text


@pytest.mark.parametrize(
    ("picture", "kind"),
    [
        (b"", "is empty"),
        (b"version https://git-lfs.github.com/spec/v1\noid", "is a pointer of Git LFS; `git lfs pull` fetches"),
        (b"<!doctype html>", "is HTML or XML"),
        (b"\xff\xd8\xff", "is a JPEG file"),
        (b"\0", "is another file, or damaged"),
    ],
)
def test_an_error_of_a_picture_names_it_and_what_it_is(tmp_path: Path, picture: bytes, kind: str) -> None:
    assert hinted(tmp_path, PNG, picture=picture).startswith(f"Not a PNG file: 'Maps/WOOD.png' {kind}")


def test_an_error_of_another_line_names_no_picture(tmp_path: Path) -> None:
    assert hinted(tmp_path, PNG, text=WALL.replace("\n  ", "\n\n\n\n\n\n")) == "Not a PNG file"


@pytest.mark.parametrize("file", ["/dev/zero", "../outside.pov", "missing.pov", "maps", "a" * 300, "b/" * 2500, "a\0b"])
def test_a_scene_that_prints_an_error_of_another_file_gets_no_hint(tmp_path: Path, file: str) -> None:
    (tmp_path / "outside.pov").write_text(WALL)
    assert hinted(tmp_path, Message(MessageKind.ERROR, "Not a PNG file", file, 3)) == "Not a PNG file"


def test_a_quoted_text_that_is_longer_than_any_name_is_no_picture(tmp_path: Path) -> None:
    text = WALL.replace("Maps/WOOD.png", "圖" * 90)
    assert hinted(tmp_path, PNG, text=text) == "Not a PNG file"


def test_a_picture_outside_the_bundle_is_not_looked_at(tmp_path: Path) -> None:
    (tmp_path / "secret.png").write_bytes(b"<")
    assert hinted(tmp_path, PNG, text=WALL.replace("Maps/WOOD", "../secret")) == "Not a PNG file"


@pytest.mark.parametrize("version", ["#version unofficial megapov 1.0;", "  # VERSION 3.5 Unofficial MegaPov 1.1;"])
def test_a_scene_of_another_dialect_is_named(tmp_path: Path, version: str) -> None:
    message = Message(MessageKind.ERROR, "Expected 'numeric expression'", "s.pov", 2)
    assert "MegaPOV" in hinted(tmp_path, message, text=f"{version}\nsphere")


def test_a_scene_of_povray_is_not_called_unofficial(tmp_path: Path) -> None:
    message = Message(MessageKind.ERROR, "Expected 'object'", "s.pov", 2)
    assert hinted(tmp_path, message, text="#version 3.7; // unofficial\nsphere") == "Expected 'object'"
