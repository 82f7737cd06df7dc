"""docs/python.md: its code runs from top to bottom, prints what the page says, and makes the pictures that it shows."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lippmann
from tests.pictures import read_png
from tests.repository import DOCS

PAGE = DOCS / "python.md"
STEP = re.compile(r"```python\n(.*?)```\n(?:\n((?:    [^\n]*\n)+))?", re.DOTALL)
PICTURE = re.compile(r"\]\((images/[\w-]+\.png)\)")


def test_the_page_runs_prints_and_draws_what_it_shows(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "images").mkdir()
    text, names = PAGE.read_text(encoding="utf-8"), dict[str, Any]()
    for code, shown in STEP.findall(text):
        exec(compile(code, PAGE.name, "exec"), names)
        expected = "".join(line[4:] + "\n" for line in shown.splitlines())
        assert capsys.readouterr().out == expected, code
    pictures = PICTURE.findall(text)
    assert pictures == [f"images/{path.name}" for path in sorted((tmp_path / "images").iterdir(), key=age)]
    for picture in pictures:
        made, kept = read_png(tmp_path / picture).astype(int), read_png(DOCS / picture).astype(int)
        assert made.shape == kept.shape
        # A pixel on an edge may fall to the other side on another machine.
        assert (np.abs(made - kept).max(axis=-1) > 2).mean() < 0.01, picture


def age(path: Path) -> int:
    return path.stat().st_mtime_ns


def test_the_page_names_everything_that_is_public() -> None:
    rows = [line.split("|")[1] for line in PAGE.read_text(encoding="utf-8").splitlines() if line.startswith("| `")]
    assert {name for row in rows for name in re.findall(r"`(\w+)`", row)} == set(lippmann.__all__)
