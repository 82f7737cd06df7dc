"""The keeper with children that are a line of shell."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from tests.integration.lippmann.conftest import alive, born, until

SLEEPS = "echo works; exec sleep 1000"
STUBBORN = "trap '' TERM; echo works; while :; do sleep 1000; done"


def test_children_start_in_order_and_end_in_the_other(tmp_path: Path) -> None:
    with _keeper(tmp_path, first=SLEEPS, second=SLEEPS) as keeper:
        assert _events(keeper, 3) == ["first working", "second working", "ready"]
        keeper.communicate("stop\n", timeout=20)
    assert keeper.returncode == 0
    assert (tmp_path / "order").read_text().split() == ["first", "second"]


def test_a_child_that_does_not_come_up_ends_everything_with_its_last_words(tmp_path: Path) -> None:
    with _keeper(tmp_path, first=SLEEPS, second="echo no such thing >&2; exit 3") as keeper:
        said = _to_the_end(keeper)
    assert "expected second to come up, got its end. Its last words:\\n  second: no such thing" in said
    assert keeper.returncode == 1


def test_a_child_that_says_nothing_is_not_waited_for_for_ever(tmp_path: Path) -> None:
    with _keeper(tmp_path, first="exec sleep 1000", start_within_s=0.3) as keeper:
        said = _to_the_end(keeper)
    assert "expected first to come up, got nothing for 0.3 s" in said


def test_a_child_that_dies_again_and_again_ends_everything(tmp_path: Path) -> None:
    with _keeper(tmp_path, first=SLEEPS, second="echo works; sleep 0.2; echo oh dear; exit 7", pause_s=0.01) as keeper:
        said = _to_the_end(keeper)
    assert said.count('"event": "restarted"') == 5
    assert "got 6 quick ends (the last with 7). Its last words:" in said
    assert "second: oh dear" in said


def test_a_child_that_does_not_want_to_end_is_killed_with_everything_below_it(tmp_path: Path) -> None:
    with _keeper(tmp_path, first=f"(setsid sleep 1000 & echo $! >{tmp_path}/below); {STUBBORN}", grace_s=0.3) as keeper:
        assert _events(keeper, 2) == ["first working", "ready"]
        below = born(int((tmp_path / "below").read_text()))
        assert below is not None
        keeper.communicate("stop\n", timeout=20)
    assert keeper.returncode == 0
    assert not alive({below})


def test_what_a_dead_child_left_below_it_is_gone_before_it_starts_again(tmp_path: Path) -> None:
    first = f"setsid sleep 1000 & echo $! >>{tmp_path}/below; echo works; wait"
    with _keeper(tmp_path, first=first, pause_s=0.01) as keeper:
        assert _events(keeper, 2) == ["first working", "ready"]
        left = born(int((tmp_path / "below").read_text()))
        assert left is not None
        pid = int((tmp_path / "pid-first").read_text())
        subprocess.run(["kill", "-KILL", str(pid)], check=True)
        assert _events(keeper, 2) == ["first died", "first restarted"]
        assert not alive({left})
        keeper.communicate("stop\n", timeout=20)


def test_everything_ends_at_once_when_whoever_started_the_keeper_is_gone(tmp_path: Path) -> None:
    with _keeper(tmp_path, first=STUBBORN, grace_s=1000) as keeper:
        assert _events(keeper, 2) == ["first working", "ready"]
        child = born(int((tmp_path / "pid-first").read_text()))
        assert child is not None
        assert keeper.stdin is not None
        keeper.stdin.close()
        until(lambda: not alive({child}), within_s=10)
        assert keeper.wait(timeout=10) == 0


_PROGRAM = """
import json, sys
from pathlib import Path
from lippmann.errors import FarmFailed
from lippmann.farm.supervisor import child as child_module
from lippmann.farm.supervisor.child import Child, ChildPlan
from lippmann.farm.supervisor.supervisor import Keeper, tell
from lippmann.farm.supervisor.descendants import adopt_orphans
from lippmann.farm.supervisor.logs import BoundedLog

asked = json.loads(sys.argv[1])
folder = Path(asked["folder"])
child_module.MAX_PAUSE_S = asked["pause_s"]
adopt_orphans()
children = [
    Child(
        ChildPlan(
            name=name,
            command=("sh", "-c", f"echo $$ >{folder}/pid-{name}; echo {name} >>{folder}/order; {script}"),
            ready_text="works",
            grace_s=asked["grace_s"],
            start_within_s=asked["start_within_s"],
        ),
        BoundedLog(folder / f"{name}.log"),
    )
    for name, script in asked["scripts"].items()
]
try:
    Keeper(children).run(needed=tuple(asked["scripts"]), when_ready=lambda: tell("ready"))
except FarmFailed as error:
    tell("failed", message=error.message)
    sys.exit(1)
"""


@contextmanager
def _keeper(
    folder: Path, *, grace_s: float = 5.0, start_within_s: float = 10.0, pause_s: float = 10.0, **scripts: str
) -> Iterator[subprocess.Popen[str]]:
    asked: dict[str, Any] = {"folder": str(folder), "grace_s": grace_s, "start_within_s": start_within_s}
    asked |= {"pause_s": pause_s, "scripts": scripts}
    keeper = subprocess.Popen(
        [sys.executable, "-P", "-c", _PROGRAM, json.dumps(asked)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    with keeper:
        try:
            yield keeper
        finally:
            if keeper.poll() is None and keeper.stdin is not None and not keeper.stdin.closed:
                keeper.stdin.close()


def _to_the_end(keeper: subprocess.Popen[str]) -> str:
    """Return everything that a keeper says; its stdin stays open, for that is its reason to live."""
    assert keeper.stdout is not None
    said = keeper.stdout.read()
    keeper.wait(timeout=20)
    return said


def _events(keeper: subprocess.Popen[str], count: int) -> list[str]:
    assert keeper.stdout is not None
    said = [json.loads(keeper.stdout.readline()) for _ in range(count)]
    return [f"{event.get('child', '')} {event['event']}".strip() for event in said]
