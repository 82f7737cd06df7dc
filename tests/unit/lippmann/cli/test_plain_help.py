"""Help texts: a command on one screen of 80 columns, with an example that the documentation has too."""

from __future__ import annotations

import re
from typing import Any

import pytest
import typer.main
from typer.testing import CliRunner

from lippmann.cli import main, plain_help
from tests.repository import DOCS

LONGEST = 64
"""The largest number of lines of a help text."""


def _paths(command: Any, path: tuple[str, ...] = ()) -> list[tuple[str, ...]]:
    inner = [(name, one) for name, one in getattr(command, "commands", {}).items() if not one.hidden]
    return [path, *(found for name, one in inner for found in _paths(one, (*path, name)))]


PATHS = _paths(typer.main.get_command(main.app))


def text_of(path: tuple[str, ...]) -> str:
    return CliRunner().invoke(main.app, [*path, "--help"], prog_name="lippmann").stdout


@pytest.mark.parametrize("path", PATHS, ids=" ".join)
def test_a_help_text_fits_on_one_screen(path: tuple[str, ...]) -> None:
    lines = text_of(path).splitlines()
    assert len(lines) <= LONGEST
    assert [line for line in lines if len(line) > plain_help.WIDTH and not line.startswith("  lippmann ")] == []


@pytest.mark.parametrize("path", [(), ("scenes",), ("keys",), ("paper",)], ids=" ".join)
def test_a_list_has_one_line_for_each_command(path: tuple[str, ...]) -> None:
    listed = text_of(path).split("Options:")[0].split(":\n", 1)[1].rstrip().splitlines()
    names = [line.split()[0] for line in listed if line.startswith("  ")]
    assert sorted(names) == sorted(found[-1] for found in PATHS if found[:-1] == path and found)
    assert all(line.startswith("  ") or line.endswith(":") for line in listed)


def test_an_example_is_one_of_a_command_and_of_its_page() -> None:
    page = (DOCS / "command.md").read_text(encoding="utf-8")
    for name, example in plain_help.EXAMPLES.items():
        assert tuple(name.split()) in PATHS
        assert example.startswith(f"lippmann {name}")
        assert example in page, example
        assert example in text_of(tuple(name.split()))


def test_an_option_shows_its_value_its_default_and_its_variable() -> None:
    shown = " ".join(text_of(("fetch",)).split())
    assert "--parallel N The number of files that are fetched at the same time." in shown
    assert "[1 to 32; LIPPMANN_FETCH_PARALLEL; default: 4]" in shown
    assert "--data-dir FOLDER" in shown
    assert re.search(r"^Usage: lippmann fetch JOB \[OPTIONS\]$", text_of(("fetch",)), re.MULTILINE)
    assert "Usage: lippmann view FILE --out FILE [OPTIONS]" in text_of(("view",))
