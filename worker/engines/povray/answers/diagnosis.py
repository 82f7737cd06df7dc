"""The answers of POV-Ray, the sandbox and the kernel, and what we do about each.

============================================ =============================== =====================================
answer                                       means                           what we do
============================================ =============================== =====================================
ended by us                                  stop, timeout, stall            Stopped, RenderTimedOut, RenderStalled
ended by us while it parsed or shot photons  limit of the phase              ParseTimedOut, PhotonsTimedOut
0, and a picture                             done                            go on
0, no picture                                it went elsewhere               RenderFailed
ended by us, a total was exceeded            files, processes or memory      RenderFailed, OutOfMemory
no room in the task's folder                 disk full                       DiskFull
1, "Timed out waiting for worker thread..."  fault of POV-Ray's start        start again at once, no attempt spent
1, "bad_alloc", "Out of memory"              memory limit                    OutOfMemory
1, "File ... line ...: Parse Error: ..."     the scene is wrong              SceneError with file and line
1, "Cannot find file ..." before it          a file is not in the bundle     SceneError that names it
1, "Cannot open input file"                  our own .pov is gone            RenderFailed
1, parser gave up and said nothing           most often the memory limit     OutOfMemory
1, "Cannot access data in file"              the picture cannot be written   DiskFull
1, "Problem with option setting"             our command line is wrong       RenderFailed
2                                            somebody else's SIGTERM         RenderFailed
SIGXCPU                                      CPU limit                       RenderTimedOut
SIGXFSZ                                      limit of a file's size          RenderCrashed
SIGABRT, "thread_resource_error"             no room for threads             RenderCrashed
SIGKILL                                      most often out of memory        RenderCrashed
another signal                               it crashed                      RenderCrashed
125 "landlock:" "enter:", 1 "bwrap:"         the sandbox did not start       SandboxMissing
127 "prlimit: failed to execute"             not installed                   PovrayMissing
anything else                                                                RenderFailed
============================================ =============================== =====================================

An error in a scene's mathematics is often none to POV-Ray: a division by zero is a warning, gives infinity, and ends
with 0.
"""

from __future__ import annotations

import re
import signal
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from lippmann.errors import (
    DiskFull,
    LippmannError,
    OutOfMemory,
    ParseTimedOut,
    PhotonsTimedOut,
    PovrayMissing,
    RenderCrashed,
    RenderFailed,
    RenderStalled,
    RenderTimedOut,
    SandboxMissing,
    SceneError,
    Stopped,
)
from worker.engines.povray.answers.hints import with_hint
from worker.engines.povray.answers.messages import Message, MessageKind, read_messages, relative
from worker.engines.povray.answers.places import ScenePlaces
from worker.engines.povray.answers.progress import Phase, Progress
from worker.sandbox.ending import Ending
from worker.sandbox.limits import Limits, TimeLimits
from worker.sandbox.process import Outcome
from worker.sandbox.sandbox import COMPLAINTS

NO_ROOM_BYTES = 1024 * 1024
"""A failure with less free room than this in the folder of the task is that of a full disk."""

_STARTUP_FAULT = "Timed out waiting for worker thread startup"
_MISSING = re.compile(r"Cannot find file '(.+?)', even after")
_NO_MEMORY = re.compile(r"bad_alloc|insufficient memory|out of memory|memory allocation failure", re.IGNORECASE)
_NOISE = re.compile(
    r"povray: cannot open the (?:user|system) configuration|povray: I/O restrictions are disabled|Render failed|\s*$"
)


@dataclass(frozen=True)
class Case:
    """The outcome of a run, with what is needed to diagnose it."""

    outcome: Outcome[Progress]
    limits: Limits
    times: TimeLimits
    roots: tuple[Path, ...]
    free_bytes: int
    places: ScenePlaces | None = None
    """The files of the scene; None for a .pov without one."""

    @property
    def messages(self) -> list[Message]:
        """POV-Ray's messages about the scene."""
        messages = read_messages(self.outcome.lines, roots=self.roots)
        return list(map(self.places.translate, messages)) if self.places else messages

    def has_line_with(self, text: str) -> bool:
        """Return whether a line of POV-Ray's output contains a text."""
        return any(text in line for line in self.outcome.lines)


def is_startup_fault(outcome: Outcome[Progress]) -> bool:
    """Return whether POV-Ray failed to start by a fault of its own, so that it only needs to be started again."""
    return (
        outcome.ending is Ending.EXITED
        and outcome.exit_code == 1
        and outcome.progress.phase is Phase.STARTING
        and any(_STARTUP_FAULT in line for line in outcome.lines)
    )


def diagnose(case: Case) -> LippmannError | None:
    """Return what an outcome means for the attempt, or None if POV-Ray ended well."""
    if case.outcome.ending is Ending.EXITED and case.outcome.exit_code == 0:
        return None
    for rule in _RULES:
        if error := rule(case):
            return error
    return RenderFailed(f"POV-Ray ended with {case.outcome.exit_code}: {last_words(case)}")


def last_words(case: Case) -> str:
    """Return the last informative line of the output, for a message."""
    said = [line.strip() for line in case.outcome.lines if not _NOISE.match(line)]
    fatal = [line for line in said if line.startswith("Fatal error")]
    return relative((fatal or said or ["it said nothing"])[-1], case.roots)[:300]


def _ended_by_us(case: Case) -> LippmannError | None:
    outcome = case.outcome
    at = f"{outcome.progress.phase.value} at {100 * outcome.progress.fraction:.0f} %"
    times = case.times
    return {
        Ending.STOPPED: Stopped(),
        Ending.TIMED_OUT: RenderTimedOut(f"POV-Ray was ended after {times.total}; {at}."),
        Ending.STALLED: RenderStalled(f"POV-Ray was ended after no progress for {times.stall}; {at}."),
        Ending.PHASE_TIMED_OUT: _phase_timed_out(case),
        Ending.TOO_MUCH: RenderFailed(f"POV-Ray was ended: {outcome.excess}; {at}."),
        Ending.TOO_MUCH_MEMORY: OutOfMemory(f"POV-Ray was ended: {outcome.excess}; {at}."),
    }.get(outcome.ending)


def _phase_timed_out(case: Case) -> LippmannError | None:
    phase = case.outcome.progress.phase
    limit = case.times.phases.get(phase)
    if phase is Phase.PARSING:
        return ParseTimedOut(f"POV-Ray was ended after it had parsed the scene for {limit}.")
    if phase is Phase.PHOTONS:
        return PhotonsTimedOut(f"POV-Ray was ended after it had shot photons for {limit}.")
    return None


def _disk_full(case: Case) -> LippmannError | None:
    if case.free_bytes < NO_ROOM_BYTES:
        return DiskFull(f"There is no room left where the worker renders: {case.free_bytes} bytes free.")
    return None


def _sandbox(case: Case) -> LippmannError | None:
    if case.outcome.progress.phase is not Phase.STARTING:
        return None
    for line in case.outcome.lines:
        if line.startswith(COMPLAINTS):
            return SandboxMissing(f"The sandbox did not start: {line}")
        if line.startswith("prlimit: failed to execute"):
            return PovrayMissing(f"POV-Ray did not start: {line}")
    return None


def _startup(case: Case) -> LippmannError | None:
    if is_startup_fault(case.outcome):
        return RenderFailed(f"POV-Ray did not start, again and again: {_STARTUP_FAULT}.")
    return None


def _signalled(case: Case) -> LippmannError | None:
    number = signal_of(case.outcome.exit_code)
    if number is None:
        return None
    if number == signal.SIGXCPU:
        return RenderTimedOut(f"POV-Ray used up its {case.limits.cpu_s:.0f} s of CPU.")
    reasons = {
        signal.SIGXFSZ: f"it wrote a file of more than {case.limits.file_mb} MB",
        signal.SIGKILL: f"most often the machine is out of memory; {_memory(case)}",
        signal.SIGABRT: f"it found no room for itself; {_memory(case)}",
    }
    reason = reasons.get(signal.Signals(number), last_words(case))
    return RenderCrashed(f"POV-Ray was ended by {signal.Signals(number).name}: {reason}.")


def _memory_limit(case: Case) -> LippmannError | None:
    silent = case.has_line_with("Fatal error in parser: Cannot parse input.") and not _errors(case)
    if silent or any(_NO_MEMORY.search(line) for line in case.outcome.lines):
        return OutOfMemory(f"POV-Ray ran out of memory: {_memory(case)}.")
    return None


def _scene(case: Case) -> LippmannError | None:
    errors = _errors(case)
    if not errors:
        return None
    error = errors[-1]
    if error.text.startswith("Cannot open input file"):
        return RenderFailed("POV-Ray did not find the .pov that the worker wrote.")
    for hint in case.messages:
        here = hint.kind is MessageKind.HINT and (hint.file, hint.line) == (error.file, error.line)
        if here and (missing := _MISSING.search(hint.text)):
            text = (
                case.places.scene.missing(missing[1]) if case.places else f"no file {missing[1]!r} in the scene bundle"
            )
            return SceneError(str(replace(hint, text=text)))
    return SceneError(str(with_hint(error, case.places.scene) if case.places else error))


def _unwritable(case: Case) -> LippmannError | None:
    if case.outcome.progress.phase is not Phase.PARSING and case.has_line_with("Cannot access data in file."):
        return DiskFull("POV-Ray could not write its picture: no room in the task's folder.")
    if case.has_line_with("Cannot create render state output file."):
        return RenderFailed("POV-Ray could not create its files in the task's folder.")
    return None


def _command_line(case: Case) -> LippmannError | None:
    if case.has_line_with("Problem with option setting"):
        return RenderFailed(f"POV-Ray refused its command line: {last_words(case)}")
    return None


def _cancelled(case: Case) -> LippmannError | None:
    if case.outcome.exit_code == 2:
        return RenderFailed("POV-Ray was cancelled by a signal from outside.")
    return None


_RULES: Sequence[Callable[[Case], LippmannError | None]] = (
    _ended_by_us,
    _disk_full,
    _sandbox,
    _startup,
    _signalled,
    _memory_limit,
    _scene,
    _unwritable,
    _command_line,
    _cancelled,
)
"""The rules in their order; the first that returns an error decides."""


def signal_of(exit_code: int) -> int | None:
    """Return the signal that ended a process, as reported by the kernel (-9) or by a shell above it (137).

    >>> signal_of(-9), signal_of(137), signal_of(1)
    (9, 9, None)
    """
    number = -exit_code if exit_code < 0 else exit_code - 128
    return number if number in set(signal.Signals) else None


def _errors(case: Case) -> list[Message]:
    """Return the errors, or the hints, such as "Cannot read PNG data", if there are no errors."""
    messages = [message for message in case.messages if message.kind is not MessageKind.WARNING]
    return [message for message in messages if message.kind is MessageKind.ERROR] or messages


def _memory(case: Case) -> str:
    return f"{case.outcome.peak_memory_mb:.0f} MB resident at most, limit {case.limits.memory_mb} MB of address space"
