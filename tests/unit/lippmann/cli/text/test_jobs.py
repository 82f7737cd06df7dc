"""Tables of the command."""

from __future__ import annotations

from lippmann.cli.text.jobs import worker_table
from service.schemas.farm import Worker


def _worker(sandbox: str) -> Worker:
    return Worker(
        name="w1", host="h", pid=1, slots=2, sandbox=sandbox, povray="3.7", version="1", started_s=0.0, seen_s=0.0,
        running=1, not_claiming_since_s=None,
    )  # fmt: skip


def test_the_sandbox_of_every_worker_is_shown() -> None:
    lines = worker_table([_worker("bwrap"), _worker("none")], now_s=1.0).splitlines()
    assert ["SANDBOX" in lines[0], "bwrap" in lines[1], "none: scenes of Lippmann only" in lines[2]] == [True] * 3
