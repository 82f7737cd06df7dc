"""The ends of a request to Mitsuba, and what they mean for the attempt.

============================================ ===============================
end                                          error
============================================ ===============================
answered with files                          none
answered: the scene, or what it asks for     SceneError
answered: a fault of ours                    RenderFailed
stopped                                      Stopped
time, CPU                                    RenderTimedOut
no progress                                  RenderStalled
memory: a total, or the kernel's limit       OutOfMemory
files, processes, lines                      RenderFailed
no room in the folder                        DiskFull
a word of the sandbox                        SandboxMissing
a word about memory that it did not get      OutOfMemory
SIGXCPU                                      RenderTimedOut
another signal                               RenderCrashed
it ended without an answer                   RenderFailed
============================================ ===============================
"""

from __future__ import annotations

import re
import signal
from dataclasses import dataclass

from lippmann.errors import (
    DiskFull,
    LippmannError,
    OutOfMemory,
    RenderCrashed,
    RenderFailed,
    RenderStalled,
    RenderTimedOut,
    SandboxMissing,
    SceneError,
    Stopped,
)
from worker.engines.mitsuba.inside.messages import Failure, Result
from worker.sandbox.ending import Ending
from worker.sandbox.limits import Limits, TimeLimits
from worker.sandbox.process import Outcome
from worker.sandbox.sandbox import COMPLAINTS

NO_ROOM_BYTES = 1024 * 1024
"""A failure with less free room than this in the folder of the session is that of a full disk."""

_NO_MEMORY = re.compile(r"MemoryError|bad_alloc|out of memory|cannot allocate memory|mmap\(\) failed", re.IGNORECASE)


@dataclass(frozen=True)
class Case:
    """The end of a request, with what is needed to diagnose it."""

    outcome: Outcome[float]
    answer: Result | Failure | None
    limits: Limits
    times: TimeLimits
    free_bytes: int


def diagnose(case: Case) -> LippmannError | None:
    """Return what the end of a request means for the attempt; None if it was answered with files."""
    ending, at = case.outcome.ending, f"at {100 * case.outcome.progress:.0f} %"
    if ending is Ending.ANSWERED:
        return _refused(case.answer)
    if ending is Ending.EXITED:
        return _ended_by_itself(case)
    excess = f"Mitsuba was ended: {case.outcome.excess}; {at}."
    by_us: dict[Ending, LippmannError] = {
        Ending.STOPPED: Stopped(),
        Ending.TIMED_OUT: RenderTimedOut(f"Mitsuba was ended after {case.times.total}; {at}."),
        Ending.TOO_MUCH_CPU: RenderTimedOut(excess),
        Ending.TOO_MUCH_MEMORY: OutOfMemory(excess),
        Ending.TOO_MUCH: RenderFailed(excess),
    }
    stalled = RenderStalled(f"Mitsuba was ended after no progress for {case.times.stall}; {at}.")
    return by_us.get(ending, stalled)


def _refused(answer: Result | Failure | None) -> LippmannError | None:
    if not isinstance(answer, Failure):
        return None
    error = answer.error
    if error.kind == "internal":
        if _NO_MEMORY.search(error.message):
            return OutOfMemory(f"Mitsuba ran out of memory: {error.message}")
        return RenderFailed(f"Mitsuba failed: {error.message}")
    return SceneError(error.message)


def _ended_by_itself(case: Case) -> LippmannError:
    outcome = case.outcome
    number = _signal_of(outcome.exit_code)
    # The shell above it says how it ended.
    of_shell = number and signal.strsignal(number)
    said = [line.strip() for line in outcome.lines if line.strip() and line.strip() != of_shell]
    last = said[-1][:300] if said else "it said nothing"
    if case.free_bytes < NO_ROOM_BYTES:
        return DiskFull(f"There is no room left where the worker renders: {case.free_bytes} bytes free.")
    for line in said:
        if line.startswith((*COMPLAINTS, "prlimit: ")):
            return SandboxMissing(f"The sandbox did not start: {line[:300]}")
    memory = (
        f"{outcome.peak_memory_mb:.0f} MB resident at most, limit {case.limits.memory_mb} MB of all processes together"
    )
    if number is signal.SIGXCPU:
        return RenderTimedOut("Mitsuba used up the CPU time of its session.")
    if any(_NO_MEMORY.search(line) for line in said):
        return OutOfMemory(f"Mitsuba ran out of memory: {memory}.")
    if number is None:
        return RenderFailed(f"Mitsuba ended with {outcome.exit_code} and without an answer: {last}")
    reasons = {
        signal.SIGXFSZ: f"it wrote a file of more than {case.limits.file_mb} MB",
        signal.SIGKILL: f"most often the machine is out of memory; {memory}",
    }
    return RenderCrashed(f"Mitsuba was ended by {number.name}: {reasons.get(number, last)}.")


def _signal_of(exit_code: int) -> signal.Signals | None:
    """Return the signal that ended a process, as reported by the kernel (-9) or by a shell above it (137)."""
    number = -exit_code if exit_code < 0 else exit_code - 128
    return signal.Signals(number) if number in set(signal.Signals) else None
