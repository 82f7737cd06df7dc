"""One warm program a slot: it serves one job of one owner, and ends with every failure."""

from __future__ import annotations

import ast
import signal
import subprocess
import sys
import threading
from dataclasses import replace
from pathlib import Path

import pytest

from lippmann.errors import RenderCrashed
from tests.unit.worker.engines.mitsuba.conftest import KEY, STAND_IN, Room
from tests.waiting import until
from worker.engines.mitsuba import session as sessions
from worker.engines.mitsuba import surroundings
from worker.engines.mitsuba.render import RenderedRegion
from worker.engines.mitsuba.session import PROGRAM_MB, Slot
from worker.engines.mitsuba.surroundings import CUDA, LLVM
from worker.sandbox.devices import Devices
from worker.sandbox.results import remove_tree


def _served(rendered: RenderedRegion) -> int:
    return int(rendered.notes[0].removeprefix("served "))


def test_one_program_serves_the_tasks_of_a_job(room: Room) -> None:
    assert [_served(room.ask()) for _ in range(3)] == [0, 1, 2]


@pytest.mark.parametrize(
    "other",
    [
        replace(KEY, owner="bert"),
        replace(KEY, job_id="another"),
        replace(KEY, bundle="another"),
        replace(KEY, limits=replace(KEY.limits, memory_mb=401)),
        replace(KEY, variant="scalar_rgb"),
    ],
    ids=["owner", "job", "bundle", "limits", "variant"],
)
def test_nothing_that_differs_shares_a_program(room: Room, other: sessions.SessionKey) -> None:
    assert [_served(room.ask()), _served(room.ask()), _served(room.ask(key=other))] == [0, 1, 0]
    assert _served(room.ask()) == 0


def test_the_program_of_a_gpu_alone_has_its_devices_and_no_limit_of_the_address_space(
    room: Room, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(surroundings, "nvidia_devices", lambda: Devices(()))
    for variant, is_limited in ((LLVM, True), (CUDA, False)):
        room.ask(key=replace(KEY, variant=variant))
        lines = [line for process in room.processes() for line in (process / "limits").read_text().splitlines()]
        sizes = {line.split()[3] for line in lines if line.startswith("Max address space")}
        assert sizes - {"unlimited"} == ({str((KEY.limits.memory_mb + PROGRAM_MB) * 2**20)} if is_limited else set())


def test_what_a_request_leaves_in_the_folder_the_next_one_does_not_find(room: Room) -> None:
    room.ask("leave")
    found = ast.literal_eval(room.ask().notes[1].removeprefix("found "))
    assert found == []


def test_a_program_that_failed_is_not_asked_again(room: Room) -> None:
    room.ask()
    with pytest.raises(RenderCrashed):
        room.ask("kill")
    assert _served(room.ask()) == 0


def test_an_error_of_the_user_ends_the_session(room: Room) -> None:
    room.ask()
    with pytest.raises(KeyError), room.session():
        raise KeyError
    until(lambda: not room.processes())
    assert _served(room.ask()) == 0


def test_it_ends_after_many_requests(room: Room, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sessions, "MAX_REQUESTS", 2)
    assert [_served(room.ask()) for _ in range(3)] == [0, 1, 0]


def test_it_ends_when_nobody_asks(room: Room) -> None:
    room.slot = Slot(idle_s=0.05)
    room.ask()
    until(lambda: not room.processes())
    assert _served(room.ask()) == 0


def test_it_does_not_end_while_it_is_lent(room: Room) -> None:
    room.slot = Slot(idle_s=0.05)
    room.ask()
    with room.session() as session:
        threading.Event().wait(0.2)
        assert session.is_open


@pytest.mark.parametrize("behaviour", ["rests", "works"])
def test_it_dies_with_the_process_of_its_slot(room: Room, behaviour: str) -> None:
    (room.bundle / "behaviour").write_text("render" if behaviour == "rests" else "sleep")
    words = [str(room.root), room.sandbox.mode, str(STAND_IN.name), behaviour]
    with subprocess.Popen([sys.executable, __file__, *words], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout
        assert process.stdout.readline() == "asked\n"
        until(lambda: len(room.processes()) > 0)
        process.kill()
    until(lambda: not room.processes())
    for folder in room.root.glob("session-*"):
        remove_tree(folder)


def _main(root: Path, mode: str, program: str, behaviour: str) -> None:
    """Keep a session in the main thread until this process is killed."""
    from contextlib import nullcontext

    from worker.engines.mitsuba.answers import AnswerReader
    from worker.sandbox.limits import TimeLimit, TimeLimits
    from worker.sandbox.log import AttemptLog
    from worker.sandbox.sandbox import Sandbox

    own = root / "session-own"
    own.mkdir(mode=0o711)
    bundle = root / "bundle"
    slot = Slot()
    limit = TimeLimit(300, "the test")
    said = threading.Event()

    def say(_: float) -> None:
        if not said.is_set():
            print("asked", flush=True)
            said.set()

    request = '{"number": 1, "out": "1", "region": [0, 1, 0, 1]}'
    arguments = (str(bundle / program),)
    sandbox = Sandbox(mode)  # type: ignore[arg-type] # from the command line
    with AttemptLog(root / "other.txt") as log:
        with slot.session(
            KEY, bundle=lambda: nullcontext(bundle), folder=lambda: nullcontext(own), sandbox=sandbox, program=arguments
        ) as session:
            session.ask(
                request,
                AnswerReader(1),
                times=TimeLimits(limit, limit),
                on_progress=say,
                should_stop=lambda: False,
                log=log,
            )
        signal.pause()


if __name__ == "__main__":
    _main(Path(sys.argv[1]), *sys.argv[2:])
