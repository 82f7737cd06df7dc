"""SECURITY.md promises only what a test shows."""

from __future__ import annotations

import re

import pytest

from tests.repository import ROOT

PAGE = (ROOT / "SECURITY.md").read_text(encoding="utf-8")
NAMED = re.findall(r"`(tests/[\w/]+\.py)::(\w+)`", PAGE)
PROMISES = PAGE.partition("## Promises")[2].partition("## What is not promised")[0]


@pytest.mark.parametrize(("file", "name"), NAMED)
def test_every_named_test_exists(file: str, name: str) -> None:
    assert re.search(rf"^def {name}\(", (ROOT / file).read_text(encoding="utf-8"), re.MULTILINE)


def test_every_promise_names_a_test() -> None:
    rows = [line for line in PROMISES.splitlines() if line.startswith("| ") and not line.startswith("| promise ")]
    assert len(rows) == len(NAMED)
    assert all(re.search(r"\| `tests/[^`]+::test_\w+` \|$", row) for row in rows)
