"""One child: its process, its log, its pauses."""

from __future__ import annotations

import os
import signal
import subprocess
from collections.abc import Mapping
from dataclasses import dataclass, field

from lippmann.farm.supervisor.descendants import dying_with
from lippmann.farm.supervisor.logs import BoundedLog

STEADY_S = 30.0
"""A child that ran for this long, s, has not died quickly."""
MAX_QUICK_DEATHS = 5
MAX_PAUSE_S = 10.0


@dataclass(frozen=True)
class ChildPlan:
    """The command that starts a child, and the condition for it to be ready."""

    name: str
    command: tuple[str, ...]
    ready_text: str
    """A text in the line that the child prints when it is ready."""
    grace_s: float
    """The time in which the child must end after SIGTERM, s."""
    environment: Mapping[str, str] = field(default_factory=dict)
    """The variables that the child gets besides those of this process."""
    kept_back: frozenset[str] = frozenset()
    """The variables of this process that the child does not get."""
    passed_descriptors: tuple[int, ...] = ()
    """The file descriptors that the child inherits."""
    start_within_s: float = 120.0
    """The limit against hanging; a busy machine takes ten times as long as an idle one. An end is noticed at once."""


class Child:
    """A child of the farm, which runs or waits for its restart."""

    def __init__(self, plan: ChildPlan, log: BoundedLog) -> None:
        self.plan = plan
        self.log = log
        self.ready = False
        self.restart_at_s: float | None = None
        self.quick_deaths = 0
        self.pause_s = 0.0
        self.process: subprocess.Popen[bytes] | None = None
        self._started_s = 0.0

    @property
    def alive(self) -> bool:
        """True while the process runs."""
        return self.process is not None

    def start(self, now_s: float) -> int:
        """Start the process; return the descriptor from which its output is read."""
        self.ready, self.restart_at_s, self._started_s = False, None, now_s
        output, child_end = os.pipe2(os.O_CLOEXEC)
        os.set_blocking(output, False)
        try:
            self.process = subprocess.Popen(
                self.plan.command,
                stdin=subprocess.DEVNULL,
                stdout=child_end,
                stderr=subprocess.STDOUT,
                env=self._environment(),
                pass_fds=self.plan.passed_descriptors,
                preexec_fn=dying_with(os.getpid()),
            )
        finally:
            os.close(child_end)
        return output

    def _environment(self) -> dict[str, str]:
        inherited = {name: value for name, value in os.environ.items() if name not in self.plan.kept_back}
        return inherited | dict(self.plan.environment)

    def terminate(self) -> None:
        """Send SIGTERM to the process."""
        if self.process is not None:
            self.process.send_signal(signal.SIGTERM)

    def receive(self, data: bytes) -> bool:
        """Log output of the process; return whether this output shows that it has become ready."""
        lines = self.log.write(data)
        just_now = not self.ready and any(self.plan.ready_text in line for line in lines)
        self.ready = self.ready or just_now
        return just_now

    def reap(self, now_s: float) -> int:
        """Record that the process ended and when it is to be restarted; return its exit code."""
        code = 0 if self.process is None else self.process.wait()
        self.process, self.ready = None, False
        self.quick_deaths = 1 if now_s - self._started_s >= STEADY_S else self.quick_deaths + 1
        self.pause_s = min(0.5 * 2.0 ** (self.quick_deaths - 1), MAX_PAUSE_S)
        self.restart_at_s = now_s + self.pause_s
        return code

    def last_lines(self) -> str:
        """Return the last lines of the output."""
        return "\n".join(f"  {self.plan.name}: {line}" for line in self.log.last_lines)
