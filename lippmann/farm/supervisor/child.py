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
"""A child that lived so long has not died quickly."""
MAX_QUICK_DEATHS = 5
MAX_PAUSE_S = 10.0


@dataclass(frozen=True)
class ChildPlan:
    """How a child is started, and how one knows that it works."""

    name: str
    command: tuple[str, ...]
    ready_text: str
    """In the line that it says when it works."""
    grace_s: float
    """How long it may take to end when it is asked to."""
    environment: Mapping[str, str] = field(default_factory=dict)
    handed_over: tuple[int, ...] = ()
    """File descriptors that it gets."""
    start_within_s: float = 30.0


class Child:
    """A child of the farm, alive or to be started anew."""

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
        """Whether its process runs."""
        return self.process is not None

    def start(self, now_s: float) -> int:
        """Start it; return the descriptor on which it speaks."""
        self.ready, self.restart_at_s, self._started_s = False, None, now_s
        speaks, writes = os.pipe2(os.O_CLOEXEC)
        os.set_blocking(speaks, False)
        try:
            self.process = subprocess.Popen(
                self.plan.command,
                stdin=subprocess.DEVNULL,
                stdout=writes,
                stderr=subprocess.STDOUT,
                env=os.environ | dict(self.plan.environment),
                pass_fds=self.plan.handed_over,
                preexec_fn=dying_with(os.getpid()),
            )
        finally:
            os.close(writes)
        return speaks

    def ask_to_end(self) -> None:
        """Ask it to end."""
        if self.process is not None:
            self.process.send_signal(signal.SIGTERM)

    def hear(self, data: bytes) -> bool:
        """Take what it said; return whether it just said that it works."""
        lines = self.log.write(data)
        just_now = not self.ready and any(self.plan.ready_text in line for line in lines)
        self.ready = self.ready or just_now
        return just_now

    def bury(self, now_s: float) -> int:
        """Note that its process ended and when it should be started anew; return its exit code."""
        code = 0 if self.process is None else self.process.wait()
        self.process, self.ready = None, False
        self.quick_deaths = 1 if now_s - self._started_s >= STEADY_S else self.quick_deaths + 1
        self.pause_s = min(0.5 * 2.0 ** (self.quick_deaths - 1), MAX_PAUSE_S)
        self.restart_at_s = now_s + self.pause_s
        return code

    def last_words(self) -> str:
        """Return the last lines that it said."""
        return "\n".join(f"  {self.plan.name}: {line}" for line in self.log.last_lines)
