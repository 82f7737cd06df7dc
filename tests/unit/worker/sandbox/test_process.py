"""The child runner with an engine of its own: a shell that prints percentages."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from hypothesis import given
from hypothesis import strategies as st

from worker.sandbox.child import lost_cpu
from worker.sandbox.ending import Ending
from worker.sandbox.groups import Groups
from worker.sandbox.limits import Limits, TimeLimit, TimeLimits
from worker.sandbox.log import AttemptLog
from worker.sandbox.output import MAX_LINE_BYTES, Lines
from worker.sandbox.process import Outcome, run


class PercentReader:
    """Reads lines such as `40 %`, and `begins` as the begin of the only phase that can be foreseen."""

    def __init__(self) -> None:
        self.progress = 0
        self.phase = "looking"

    @property
    def growth(self) -> float:
        return self.progress / 100

    def read(self, line: str) -> bool:
        if line.endswith(" %"):
            self.progress = int(line.removesuffix(" %"))
            return True
        self.phase = "working" if line == "begins" else self.phase
        return False


def _run(
    folder: Path,
    script: str,
    *,
    total_s: float = 120,
    stall_s: float = 60,
    look_s: float = 60,
    on_progress: Callable[[int], None] = lambda progress: None,
    should_stop: Callable[[], bool] = lambda: False,
    groups: Groups | None = None,
) -> Outcome[int]:
    with AttemptLog(folder / "log.txt") as log:
        return run(
            ["/bin/sh", "-c", script],
            cwd=folder,
            env={"PATH": "/usr/bin:/bin"},
            times=TimeLimits(
                total=TimeLimit(total_s, "total"),
                stall=TimeLimit(stall_s, "stall"),
                phases={"looking": TimeLimit(look_s, "look")},
            ),
            reader=PercentReader(),
            on_progress=on_progress,
            should_stop=should_stop,
            log=log,
            limits=None if groups is None else Limits(cpu_s=60, memory_mb=1000),
            groups=groups,
        )


def test_the_engines_own_progress_is_reported_and_kept_out_of_the_last_lines(tmp_path: Path) -> None:
    reported: list[int] = []
    outcome = _run(tmp_path, "echo begins; echo '40 %'; echo '100 %'; echo ends; exit 3", on_progress=reported.append)
    assert (outcome.ending, outcome.exit_code, outcome.progress) == (Ending.EXITED, 3, 100)
    assert reported[-1] == 100
    assert outcome.lines == ("begins", "ends")
    assert (tmp_path / "log.txt").read_text().split("\n")[:2] == ["begins", "40 %"]


def test_a_child_whose_progress_stays_equal_is_ended_as_stalled(tmp_path: Path) -> None:
    outcome = _run(tmp_path, "echo begins; while true; do echo '7 %'; sleep 0.1; done", stall_s=0.5)
    assert (outcome.ending, outcome.progress) == (Ending.STALLED, 7)


ENDLESS = 'i=0; while true; do i=$((i + 1)); echo "$i %"; sleep 0.1; done'


def test_a_phase_with_a_limit_ends_there_however_its_progress_grows(tmp_path: Path) -> None:
    assert _run(tmp_path, ENDLESS, look_s=1.0, stall_s=0.5).ending is Ending.PHASE_TIMED_OUT


def test_a_phase_with_a_limit_does_not_stall_and_the_next_one_begins_with_its_whole_time(tmp_path: Path) -> None:
    outcome = _run(tmp_path, "sleep 1.5; echo begins; sleep 0.2; echo '100 %'", look_s=60, stall_s=1.0)
    assert (outcome.ending, outcome.progress) == (Ending.EXITED, 100)


def test_growth_outside_of_such_a_phase_goes_on_until_the_total_time(tmp_path: Path) -> None:
    outcome = _run(tmp_path, f"echo begins; {ENDLESS}", total_s=1.5, stall_s=1.0, look_s=0.3)
    assert outcome.ending is Ending.TIMED_OUT


def test_a_child_is_ended_when_it_should_stop(tmp_path: Path) -> None:
    reported: list[int] = []
    outcome = _run(
        tmp_path,
        "echo '1 %'; sleep 600",
        on_progress=reported.append,
        should_stop=lambda: bool(reported),
    )
    assert outcome.ending is Ending.STOPPED


@given(st.lists(st.integers(0, 40), max_size=12))
def test_lines_are_the_same_however_the_bytes_are_cut(cuts: list[int]) -> None:
    printed = b"Rendered 1 of 2\rRendered 2 of 2\r\nPOV-Ray finished\nno end"
    lines, found, at = Lines(), [], 0
    for cut in cuts:
        found += lines.feed(printed[at : at + cut])
        at += cut
    found += lines.feed(printed[at:]) + lines.close()
    assert found == ["Rendered 1 of 2", "Rendered 2 of 2", "", "POV-Ray finished", "no end"]


def test_a_line_without_end_is_cut() -> None:
    lines = Lines()
    found = [line for _ in range(100) for line in lines.feed(b"x" * 1000)]
    assert found
    assert max(map(len, found)) <= MAX_LINE_BYTES


def test_cpu_time_that_only_the_group_has_counted_is_counted(tmp_path: Path) -> None:
    before_s = lost_cpu.seconds
    script = "for group in lippmann-task-*; do echo usage_usec 3000000 >$group/cpu.stat; done"
    assert _run(tmp_path, script, groups=Groups((tmp_path,))).cpu_s == 3
    assert 2 < lost_cpu.seconds - before_s <= 3
    assert _run(tmp_path, "true", groups=Groups((tmp_path,))).cpu_s < 1
