"""Places in the .pov of a job become places in the files of its scene."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from worker.engines.povray.answers.messages import Message, MessageKind
from worker.engines.povray.answers.places import ScenePlaces
from worker.engines.povray.scenes.scene_files import SceneFiles

FRAME = '#include "lippmann/stage.inc"\n\n#include "s.pov"\n\nglobal_settings { max_trace_level 24 }\n'


def places_of(folder: Path, file: str) -> ScenePlaces:
    """Return the places of a bundle in a folder, whose .pov lies beside it."""
    pov = folder / "lippmann-frame.pov"
    pov.write_text(FRAME)
    return ScenePlaces(pov, SceneFiles(folder, file))


def test_a_file_that_has_disappeared_has_one_line(tmp_path: Path) -> None:
    message = Message(MessageKind.ERROR, "an error", "lippmann-frame.pov", 5)
    assert places_of(tmp_path, "s.pov").translate(message).line == 1


@pytest.mark.parametrize(
    ("file", "line", "expected"),
    [
        ("old/s.pov", 1, "old/s.pov line 1: an error"),
        ("lippmann-frame.pov", 1, "lippmann-frame.pov line 1: an error"),
        ("lippmann-frame.pov", 3, "old/s.pov line 2: an error"),
        (
            "lippmann-frame.pov",
            5,
            "old/s.pov line 2: an error (noticed at the end)",
        ),
        (
            "lippmann/depth.inc",
            9,
            "old/s.pov line 2: an error (noticed at the end)",
        ),
        ("lippmann/own.inc", 9, "lippmann/own.inc line 9: an error"),
        (None, None, "an error"),
    ],
)
def test_a_message_names_a_place_in_the_scene(
    tmp_path: Path, file: str | None, line: int | None, expected: str
) -> None:
    (tmp_path / "old").mkdir()
    (tmp_path / "old" / "s.pov").write_text("union {\nsphere { 0, 1 }")
    places = places_of(tmp_path, "old/s.pov")
    assert str(places.translate(Message(MessageKind.ERROR, "an error", file, line))) == expected


@pytest.mark.parametrize(
    ("line", "text", "expected"),
    [
        (
            3,
            "Illegal character in input file, value is ef.",
            "s.pov line 1: Illegal character in input file, value is ef.",
        ),
        (
            3,
            "Illegal character in input file, value is ff.",
            "s.pov line 1: .* Is a file in UTF-16\\? Save it as UTF-8.",
        ),
        (3, "No */ closing comment found.", r"s.pov line 2: No \*/ closing comment found."),
        (
            5,
            "No matching } in 'union', global_settings found instead",
            r"s.pov line 2: No matching } in 'union', the end of the file found instead \(noticed at the end\)",
        ),
    ],
)
def test_an_error_at_the_end_of_a_scene_names_no_word_of_ours(
    tmp_path: Path, line: int, text: str, expected: str
) -> None:
    (tmp_path / "s.pov").write_bytes(b"// a union\nunion {")
    places = places_of(tmp_path, "s.pov")
    message = Message(MessageKind.ERROR, text, "lippmann-frame.pov", line)
    assert re.fullmatch(expected, str(places.translate(message)))
