"""A child that stays: it answers, rests frozen, and every request without an answer ends it."""

from __future__ import annotations

import os
import resource
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.waiting import until
from worker.sandbox.child import lost_cpu
from worker.sandbox.conversation import MAX_LINES, Conversation
from worker.sandbox.ending import Ending
from worker.sandbox.limits import Limits, TimeLimit, TimeLimits
from worker.sandbox.log import AttemptLog
from worker.sandbox.process import Outcome

LIMITS = Limits(cpu_s=60, memory_mb=1000, disk_mb=8)
LARGEST_OF_SELECT = 1023
"""The largest descriptor for which the system call `select` has a place."""


class Reader:
    """Reads lines such as `40 %`, and the answer `= text`."""

    phase = "working"

    def __init__(self) -> None:
        self.progress = 0
        self.answer = ""

    @property
    def growth(self) -> float:
        return self.progress / 100

    @property
    def has_answer(self) -> bool:
        return bool(self.answer)

    def read(self, line: str) -> bool:
        if line.endswith(" %"):
            self.progress = int(line.removesuffix(" %"))
            return True
        if line.startswith("= "):
            self.answer = self.answer or line
        return False


def _start(folder: Path, on_line: str, *, limits: Limits = LIMITS) -> Conversation:
    script = f"while read line; do {on_line}\ndone"
    env = {"PATH": "/usr/bin:/bin"}
    work = folder / "work"
    work.mkdir()
    return Conversation(["/bin/bash", "-c", script], cwd=work, env=env, limits=limits)


def _ask(
    talk: Conversation,
    folder: Path,
    text: str = "one",
    *,
    total_s: float = 120,
    stall_s: float = 60,
    on_progress: Callable[[int], None] = lambda progress: None,
    should_stop: Callable[[], bool] = lambda: False,
) -> tuple[Outcome[int], str]:
    reader = Reader()
    times = TimeLimits(total=TimeLimit(total_s, "total"), stall=TimeLimit(stall_s, "stall"))
    with AttemptLog(folder / "log.txt") as log:
        outcome = talk.ask(text, times=times, reader=reader, on_progress=on_progress, should_stop=should_stop, log=log)
    return outcome, reader.answer


def test_one_child_answers_one_request_after_the_other_with_progress(tmp_path: Path) -> None:
    reported: list[int] = []
    with _start(tmp_path, 'echo "40 %"; sleep 0.1; echo said; echo "= $line $$"') as talk:
        first, one = _ask(talk, tmp_path, "one", on_progress=reported.append)
        second, two = _ask(talk, tmp_path, "two")
    assert (first.ending, second.ending) == (Ending.ANSWERED, Ending.ANSWERED)
    assert one.split()[1:] == ["one", two.split()[2]]
    assert two.split()[1] == "two"
    assert reported == [40]
    assert first.lines == ("said", one)
    assert "said\n" in (tmp_path / "log.txt").read_text()


def test_the_cpu_of_a_child_that_goes_on_counts_at_once_and_only_once(tmp_path: Path) -> None:
    def used_s() -> float:
        used = resource.getrusage(resource.RUSAGE_CHILDREN)
        return used.ru_utime + used.ru_stime + lost_cpu.seconds

    with _start(tmp_path, 'for i in {1..300000}; do :; done; echo "= done"') as talk:
        before_s = used_s()
        outcome, _ = _ask(talk, tmp_path)
        after_s = used_s()
    assert outcome.cpu_s > 0.2
    assert after_s - before_s == pytest.approx(outcome.cpu_s, abs=0.02)
    assert used_s() == pytest.approx(after_s, abs=0.1)


def test_a_request_that_is_larger_than_a_pipe_arrives_whole(tmp_path: Path) -> None:
    with _start(tmp_path, 'echo "= ${#line}"') as talk:
        assert _ask(talk, tmp_path, "x" * 300_000)[1] == "= 300000"


def test_a_child_answers_a_process_that_has_more_than_a_thousand_files_open(
    tmp_path: Path,
) -> None:
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))
    opened = [os.open(os.devnull, os.O_RDONLY)]
    try:
        while opened[-1] < LARGEST_OF_SELECT:
            opened.append(os.open(os.devnull, os.O_RDONLY))
        with _start(tmp_path, 'echo "= ${#line}"') as talk:
            assert _ask(talk, tmp_path, "x" * 300_000)[1] == "= 300000"
    finally:
        for descriptor in opened:
            os.close(descriptor)
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))


def test_a_child_that_does_not_read_holds_nothing_up(tmp_path: Path) -> None:
    with _start(tmp_path, "exec sleep 1000") as talk:
        outcome, _ = _ask(talk, tmp_path, "x" * 300_000 + " ", total_s=0.3)
    assert outcome.ending is Ending.TIMED_OUT


def test_while_nobody_asks_the_child_and_what_it_has_started_do_nothing(tmp_path: Path) -> None:
    with _start(tmp_path, '(while true; do :; done) & echo "= $!"') as talk:
        _, answer = _ask(talk, tmp_path)
        status = Path("/proc", answer.removeprefix("= "), "stat")
        until(lambda: _words(status)[0] == "T")
        before = _words(status)[11:13]
        time.sleep(0.2)
        assert _words(status)[11:13] == before
    until(lambda: not status.exists())


def _words(status: Path) -> list[str]:
    return status.read_text().rpartition(")")[2].split()


@pytest.mark.parametrize(
    ("on_line", "ending"),
    [
        ("echo '7 %'; exec sleep 1000", Ending.STALLED),
        ("head -c 20000000 /dev/zero >full; exec sleep 1000", Ending.TOO_MUCH),
        ("while true; do :; done", Ending.TOO_MUCH_CPU),
        (f"seq {MAX_LINES + 10}; exec sleep 1000", Ending.TOO_MUCH),
    ],
)
def test_a_request_that_exceeds_a_limit_ends_the_child(tmp_path: Path, on_line: str, ending: Ending) -> None:
    limits = Limits(cpu_s=0.5, memory_mb=1000, disk_mb=8)
    stall_s = 0.5 if ending is Ending.STALLED else 60
    talk = _start(tmp_path, on_line, limits=limits)
    outcome, _ = _ask(talk, tmp_path, stall_s=stall_s)
    assert outcome.ending is ending, outcome
    assert not talk.is_open
    with pytest.raises(ValueError, match="got one that is over"):
        _ask(talk, tmp_path)


def test_memory_of_all_processes_together_ends_the_child(tmp_path: Path) -> None:
    hog = 'for i in 1 2 3; do (x=$(head -c 30000000 /dev/zero | tr "\\\\0" x); sleep 1000) & done; wait'
    talk = _start(tmp_path, hog, limits=Limits(cpu_s=60, memory_mb=60))
    outcome, _ = _ask(talk, tmp_path)
    assert outcome.ending is Ending.TOO_MUCH_MEMORY


def test_a_child_is_ended_when_it_should_stop(tmp_path: Path) -> None:
    talk = _start(tmp_path, "exec sleep 1000")
    outcome, _ = _ask(talk, tmp_path, should_stop=lambda: True)
    assert (outcome.ending, talk.is_open) == (Ending.STOPPED, False)


def test_a_child_that_ends_in_a_request_is_told_with_its_signal(tmp_path: Path) -> None:
    talk = _start(tmp_path, "echo last words; kill -9 $$")
    outcome, _ = _ask(talk, tmp_path)
    assert (outcome.ending, outcome.exit_code, outcome.lines) == (Ending.EXITED, -9, ("last words",))
    assert not talk.is_open


def test_a_child_that_has_ended_meanwhile_fails_the_next_request(tmp_path: Path) -> None:
    with _start(tmp_path, 'echo "= $$"') as talk:
        _, answer = _ask(talk, tmp_path)
        os.kill(int(answer.removeprefix("= ")), 9)
        outcome, nothing = _ask(talk, tmp_path)
    assert (outcome.ending, outcome.exit_code, nothing) == (Ending.EXITED, -9, "")


def test_an_error_of_a_callback_ends_the_child(tmp_path: Path) -> None:
    def broken(progress: int) -> None:
        raise KeyboardInterrupt

    talk = _start(tmp_path, "echo '5 %'; exec sleep 1000")
    with pytest.raises(KeyboardInterrupt):
        _ask(talk, tmp_path, on_progress=broken)
    assert not talk.is_open


def test_cpu_seconds_are_those_of_the_request(tmp_path: Path) -> None:
    burn = 'if [ $line = burn ]; then for ((i = 0; i < 300000; i++)); do :; done; fi; echo "= done"'
    with _start(tmp_path, burn) as talk:
        burnt, _ = _ask(talk, tmp_path, "burn")
        idle, _ = _ask(talk, tmp_path, "idle")
    assert burnt.cpu_s > 0.1
    assert idle.cpu_s < burnt.cpu_s / 3


def test_a_request_has_one_line(tmp_path: Path) -> None:
    with _start(tmp_path, "echo = no") as talk, pytest.raises(ValueError, match="one line"):
        _ask(talk, tmp_path, "a\nb")
