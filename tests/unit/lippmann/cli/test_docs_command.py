"""`lippmann docs`: what it lists, writes and opens."""

from __future__ import annotations

import json
import webbrowser
from pathlib import Path

import pytest
from typer.testing import CliRunner

from lippmann.cli.main import app
from tests.repository import DOCS


@pytest.fixture
def opened(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The URLs that a browser was asked to open."""
    urls: list[str] = []

    def open_url(url: str) -> bool:
        urls.append(url)
        return True

    monkeypatch.setattr(webbrowser, "open", open_url)
    return urls


def test_docs_opens_the_table_of_contents_from_the_cache(
    tmp_path: Path, opened: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    ended = CliRunner().invoke(app, ["docs"])
    assert ended.exit_code == 0, ended.output
    file = Path(ended.stdout.strip())
    assert file.is_relative_to(tmp_path)
    assert opened == [file.as_uri()]
    assert "<h1" in file.read_text(encoding="utf-8")


def test_docs_writes_a_page_to_a_folder_without_a_browser(tmp_path: Path, opened: list[str]) -> None:
    ended = CliRunner().invoke(app, ["docs", "printing", "--out", str(tmp_path), "--no-open", "--json"])
    assert json.loads(ended.stdout)["file"] == str(tmp_path / "printing.html")
    assert (tmp_path / "images" / "print.webp").is_file()
    assert opened == []


def test_docs_lists_every_page_with_its_title() -> None:
    ended = CliRunner().invoke(app, ["docs", "--list"])
    lines = ended.stdout.splitlines()
    assert len(lines) == 1 + len(list(DOCS.rglob("*.md")))
    assert lines[1].startswith("README ")
