"""The supervisor with children that are one line of shell."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from tests.integration.lippmann.conftest import alive, born
from tests.waiting import ENOUGH_S, until

SLEEPS = "echo works; exec sleep 1000"
STUBBORN = "trap '' TERM; echo works; while :; do sleep 1000; done"


def test_children_start_in_order_and_end_in_the_other(tmp_path: Path) -> None:
    with _supervisor(tmp_path, first=SLEEPS, second=SLEEPS) as process:
        assert _events(process, 3) == ["first child_ready", "second child_ready", "ready"]
        process.communicate("stop\n", timeout=ENOUGH_S)
    assert process.returncode == 0
    assert (tmp_path / "order").read_text().split() == ["first", "second"]


def test_a_child_that_does_not_come_up_ends_everything_with_its_last_output(tmp_path: Path) -> None:
    with _supervisor(tmp_path, first=SLEEPS, second="echo no such thing >&2; exit 3") as process:
        said = _to_the_end(process)
    assert "expected second to start, got its end. Its last output:\\n  second: no such thing" in said
    assert process.returncode == 1


def test_a_child_that_says_nothing_is_not_waited_for_for_ever(tmp_path: Path) -> None:
    with _supervisor(tmp_path, first="exec sleep 1000", start_within_s=0.3) as process:
        said = _to_the_end(process)
    assert "expected first to start, got no answer for 0.3 s" in said


def test_a_child_that_dies_again_and_again_ends_everything(tmp_path: Path) -> None:
    with _supervisor(
        tmp_path, first=SLEEPS, second="echo works; sleep 0.2; echo oh dear; exit 7", pause_s=0.01
    ) as process:
        said = _to_the_end(process)
    assert said.count('"event": "restarted"') == 5
    assert "got 6 quick ends (the last with 7). Its last output:" in said
    assert "second: oh dear" in said


def test_a_child_that_does_not_want_to_end_is_killed_with_everything_below_it(tmp_path: Path) -> None:
    with _supervisor(
        tmp_path, first=f"(setsid sleep 1000 & echo $! >{tmp_path}/below); {STUBBORN}", grace_s=0.3
    ) as process:
        assert _events(process, 2) == ["first child_ready", "ready"]
        below = born(int((tmp_path / "below").read_text()))
        assert below is not None
        process.communicate("stop\n", timeout=ENOUGH_S)
    assert process.returncode == 0
    assert not alive({below})


def test_what_a_dead_child_left_below_it_is_gone_before_it_starts_again(tmp_path: Path) -> None:
    first = f"setsid sleep 1000 & echo $! >>{tmp_path}/below; echo works; wait"
    with _supervisor(tmp_path, first=first, pause_s=0.01) as process:
        assert _events(process, 2) == ["first child_ready", "ready"]
        left = born(int((tmp_path / "below").read_text()))
        assert left is not None
        pid = int((tmp_path / "pid-first").read_text())
        subprocess.run(["kill", "-KILL", str(pid)], check=True)
        assert _events(process, 2) == ["first died", "first restarted"]
        assert not alive({left})
        process.communicate("stop\n", timeout=ENOUGH_S)


def test_everything_ends_at_once_when_the_process_that_started_the_supervisor_is_gone(tmp_path: Path) -> None:
    with _supervisor(tmp_path, first=STUBBORN, grace_s=1000) as process:
        assert _events(process, 2) == ["first child_ready", "ready"]
        child = born(int((tmp_path / "pid-first").read_text()))
        assert child is not None
        assert process.stdin is not None
        process.stdin.close()
        until(lambda: not alive({child}))
        assert process.wait(ENOUGH_S) == 0


_PROGRAM = """
import json, sys
from pathlib import Path
from lippmann.errors import FarmFailed
from lippmann.farm.supervisor import child as child_module
from lippmann.farm.supervisor.child import Child, ChildPlan
from lippmann.farm.supervisor.supervisor import Supervisor, send_event
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
    Supervisor(children).run(needed=tuple(asked["scripts"]), when_ready=lambda: send_event("ready"))
except FarmFailed as error:
    send_event("failed", message=error.message)
    sys.exit(1)
"""


@contextmanager
def _supervisor(
    folder: Path, *, grace_s: float = ENOUGH_S, start_within_s: float = ENOUGH_S, pause_s: float = 10.0, **scripts: str
) -> Iterator[subprocess.Popen[str]]:
    asked: dict[str, Any] = {"folder": str(folder), "grace_s": grace_s, "start_within_s": start_within_s}
    asked |= {"pause_s": pause_s, "scripts": scripts}
    process = subprocess.Popen(
        [sys.executable, "-P", "-c", _PROGRAM, json.dumps(asked)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    with process:
        try:
            yield process
        finally:
            if process.poll() is None and process.stdin is not None and not process.stdin.closed:
                process.stdin.close()


def _to_the_end(process: subprocess.Popen[str]) -> str:
    """Return everything that a supervisor says; its stdin stays open, for that is its reason to live."""
    assert process.stdout is not None
    said = process.stdout.read()
    process.wait(timeout=ENOUGH_S)
    return said


def _events(process: subprocess.Popen[str], count: int) -> list[str]:
    assert process.stdout is not None
    said = [json.loads(process.stdout.readline()) for _ in range(count)]
    return [f"{event.get('child', '')} {event['event']}".strip() for event in said]
