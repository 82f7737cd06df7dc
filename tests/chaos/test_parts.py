"""The parts of a farm under chaos: what was killed starts again."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from random import Random

import pytest

from tests.chaos.parts import Part
from tests.tcp_proxy import tcp_proxy


@pytest.fixture
def part(tmp_path: Path) -> Iterator[Part]:
    with tcp_proxy(("127.0.0.1", 1)) as link:
        made = Part("sleep", ["sleep", "1000"], os.environ, tmp_path / "sleep.log", link)
        yield made
        if made.lives:
            made.kill()


def test_a_part_that_was_killed_starts_again_at_once(part: Part) -> None:
    seen = set()
    for seed in range(5):
        part.start()
        seen.add(part.pid)
        part.kill_one(Random(seed))
    assert len(seen) == 5


def test_a_dead_part_is_not_killed_again(part: Part) -> None:
    part.start()
    part.kill()
    part.kill_one(Random(0))
    assert not part.lives
