"""The output of a command: no text of a stranger moves the cursor or changes the terminal."""

from __future__ import annotations

import pytest

from lippmann.terminal.output import Output

HOSTILE = "bad\x1b[31m\x07\x9b2J\r\nline\roverwritten\ttab\x7f"
HARMLESS = "bad\\x1b[31m\\x07\\x9b2J\nline\noverwritten\ttab\\x7f\n"


def test_control_characters_are_printed_as_escapes(capsys: pytest.CaptureFixture[str]) -> None:
    output = Output(as_json=False)
    output.result(None, HOSTILE)
    output.note(HOSTILE)
    assert capsys.readouterr() == (HARMLESS, HARMLESS)


def test_json_has_no_control_characters(capsys: pytest.CaptureFixture[str]) -> None:
    Output(as_json=True).result({"text": HOSTILE}, "")
    printed = capsys.readouterr().out
    assert not any(ord(letter) < 32 or 127 <= ord(letter) < 160 for letter in printed.rstrip("\n"))
