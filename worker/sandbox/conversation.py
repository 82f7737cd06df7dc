"""A child in the sandbox that stays: it is asked in lines on its input and answers in lines on its output.

While nobody asks, the child and all processes below it are frozen: they use no CPU and write nothing that nobody sees.
Between two requests, its folder can be looked through as if the child had ended. A request that does not end in an
answer ends the child.

When the worker is killed, the sandbox's PDEATHSIG ends the child too: the kernel sends it when the *thread* that
started the child ends, so a conversation belongs to a thread that lives as long as it, such as the main one.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import ExitStack, suppress
from functools import partial
from pathlib import Path
from threading import RLock
from typing import Protocol, TypeVar

from worker.sandbox.child import lost_cpu
from worker.sandbox.ending import POLL_S, Ending, EndingRule, Excess
from worker.sandbox.groups import Groups
from worker.sandbox.limits import Limits, TimeLimits
from worker.sandbox.log import AttemptLog
from worker.sandbox.output import Interval, OutputReader, ProgressReader
from worker.sandbox.process import REPORT_S, Outcome, group_of, started
from worker.sandbox.totals import find_excess

MAX_LINES = 100_000
"""The greatest number of lines that one request may be answered with."""

MAX_ANSWER_BYTES = 1 << 20
"""The greatest length of a line of an answer; a longer one is cut."""

P = TypeVar("P", covariant=True)
Q = TypeVar("Q")


class AnswerReader(ProgressReader[P], Protocol[P]):
    """Reads progress and one answer."""

    @property
    def has_answer(self) -> bool:
        """True when the answer has been read; nothing is read after it."""
        ...


class Conversation:
    """A child that answers; as a context manager, it has ended when the context is left.

    Parameters
    ----------
    argv, cwd, env
        The command line inside the sandbox, working directory and whole environment of the child.
    limits
        The totals of its folder, of memory, processes and, for each request, of CPU seconds.
    groups
        Where the child has a group of its own.

    Raises
    ------
    SandboxMissing
        If the child cannot be started, or its group cannot be made.
    """

    def __init__(
        self, argv: Sequence[str], *, cwd: Path, env: Mapping[str, str], limits: Limits, groups: Groups | None = None
    ) -> None:
        self._cwd = cwd
        self._limits = limits
        self._lock = RLock()
        self._open = ExitStack()
        try:
            self._group = self._open.enter_context(group_of(groups, limits))
            words = argv if self._group is None else self._group.entering(argv)
            self._child = self._open.enter_context(started(words, cwd, env, listens=True))
        except BaseException:
            self._open.close()
            raise
        self._is_open = True
        self._lent_cpu_s = 0.0

    @property
    def is_open(self) -> bool:
        """True if it can be asked."""
        return self._is_open

    def ask(
        self,
        request: str,
        *,
        times: TimeLimits,
        reader: AnswerReader[Q],
        on_progress: Callable[[Q], None],
        should_stop: Callable[[], bool],
        log: AttemptLog,
    ) -> Outcome[Q]:
        """Send one line and wait for the answer; see `process.run` for the parameters.

        Returns
        -------
        Outcome
            With the ending `ANSWERED` if the reader has its answer; the child may have ended then, see `is_open`. With
            every other ending, it has. The CPU seconds are those of this request.

        Raises
        ------
        ValueError
            If the conversation is over, or the request has several lines.
        """
        if "\n" in request:
            raise ValueError("expected a request of one line, got several")
        with self._lock:
            if not self._is_open:
                raise ValueError("expected a conversation that goes on, got one that is over")
            goes_on = False
            try:
                outcome = self._ask(request, times, reader, on_progress, should_stop, log)
                goes_on = outcome.ending is Ending.ANSWERED and bool(self._child.pids())
                if goes_on:
                    self._lent_cpu_s += outcome.cpu_s
                    lost_cpu.lend(outcome.cpu_s)
            finally:
                if not goes_on:
                    self.close()
            return outcome

    def close(self) -> None:
        """End the child and all processes below it."""
        with self._lock:
            self._is_open = False
            self._open.close()
            # The kernel has counted the whole child now, unless nobody waited for what was below it.
            lent_s, self._lent_cpu_s = self._lent_cpu_s, 0.0
            lost_cpu.lend(-min(lent_s, self._child.cpu_s))

    def __enter__(self) -> Conversation:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _ask(
        self,
        request: str,
        times: TimeLimits,
        reader: AnswerReader[Q],
        on_progress: Callable[[Q], None],
        should_stop: Callable[[], bool],
        log: AttemptLog,
    ) -> Outcome[Q]:
        child, started_s, cpu_before_s = self._child, time.monotonic(), self._cpu_s()
        output = OutputReader(log, reader, max_line_bytes=MAX_ANSWER_BYTES)
        rule = EndingRule(reader, times, should_stop)
        rule.find_excess = partial(self._excess, output, cpu_before_s)
        reported, report_timer = reader.progress, Interval(REPORT_S)
        child.thaw()
        child.send(request.encode() + b"\n")
        while not child.is_over():
            output.feed(child.read(POLL_S if reader.progress == reported else REPORT_S))
            if rule.update() is not Ending.EXITED:
                child.end()
            elif reader.has_answer:
                if child.freeze():
                    break
                rule.ending, rule.excess = Ending.TOO_MUCH, "it did not stand still after its answer"
            if reader.progress != reported and report_timer.is_due():
                reported = reader.progress
                on_progress(reported)
        output.close()
        if reader.progress != reported:
            on_progress(reader.progress)
        if reader.has_answer and rule.ending is Ending.EXITED:
            rule.ending = Ending.ANSWERED
        if child.is_over():
            self._judge_end(rule)
        return Outcome(
            ending=rule.ending,
            exit_code=child.exit_code,
            lines=tuple(output.kept),
            progress=reader.progress,
            wall_s=time.monotonic() - started_s,
            cpu_s=max(0.0, self._cpu_s() - cpu_before_s),
            peak_memory_mb=max(child.peak_memory_mb, _peak_mb(child.pids())),
            excess=rule.excess,
        )

    def _judge_end(self, rule: EndingRule) -> None:
        if self._group is None:
            return
        lost_cpu.add(counted_s=self._child.cpu_s, of_group_s=self._group.cpu_s())
        if self._group.ran_out_of_memory():
            rule.run_out_of_memory(self._limits)

    def _cpu_s(self) -> float:
        of_group_s = 0.0 if self._group is None else self._group.cpu_s()
        return max(of_group_s, self._child.used_cpu_s())

    def _excess(self, output: OutputReader, cpu_before_s: float) -> Excess | None:
        limits = self._limits
        if self._cpu_s() - cpu_before_s > limits.cpu_s:
            return Excess(f"it used up its {limits.cpu_s:.0f} s of CPU", Ending.TOO_MUCH_CPU)
        if output.lines > MAX_LINES:
            return Excess(f"it answered with more than {MAX_LINES} lines")
        return find_excess(self._cwd, self._child.pids(), limits)


def _peak_mb(pids: Iterable[int]) -> float:
    """Return the greatest resident memory that one of some processes has had."""
    peaks = [0.0]
    for pid in pids:
        with suppress(OSError):
            status = Path(f"/proc/{pid}/status").read_text(errors="replace").splitlines()
            peaks += [int(line.split()[1]) / 1024 for line in status if line.startswith("VmHWM:")]
    return max(peaks)
