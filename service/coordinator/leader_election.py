"""Leader election: a row with a deadline that the leader renews, and a shorter deadline on this machine's own clock.

A leader whose process has died on this machine is replaced at once, so that a farm that was killed goes on as soon as
it is started again.
"""

from __future__ import annotations

import hashlib
import os
import platform
import secrets
import time
from collections.abc import Callable
from pathlib import Path

from service.db import coordinator as coordinator_rows
from service.db.engine import Database

SAFETY = 0.9
"""The part of its time to live for which a leader believes that it leads, so that two processes never both do."""


class LeaderElection:
    """The candidacy of this process.

    Parameters
    ----------
    ttl_s
        A leader that does not renew for longer is replaced.
    steady
        A clock that is never set, in seconds.
    """

    def __init__(self, database: Database, *, ttl_s: float, steady: Callable[[], float] = time.monotonic) -> None:
        self._prefix = f"{platform.node()[:50]}-{_process_space()}-"
        self.name = f"{self._prefix}{os.getpid()}-{secrets.token_hex(3)}"
        self._database = database
        self._ttl_s = ttl_s
        self._steady = steady
        self._until_s = float("-inf")

    @property
    def is_leader(self) -> bool:
        """True if this process leads now; it becomes False on its own if the row is not renewed in time."""
        return self._steady() < self._until_s

    def renew(self, *, now_s: float) -> bool:
        """Become or remain the leader; return whether this process leads."""
        # The deadline counts from before the row was written.
        begun_s = self._steady()
        with self._database.writing() as session:
            leader = coordinator_rows.current(session).leader
            if leader is not None and self._has_died(leader):
                coordinator_rows.release_leadership(session, leader)
            won = coordinator_rows.acquire_leadership(session, self.name, now_s=now_s, until_s=now_s + self._ttl_s)
        self._until_s = begun_s + SAFETY * self._ttl_s if won else float("-inf")
        return won

    def step_down(self) -> None:
        """Allow another process to lead at once."""
        self._until_s = float("-inf")
        with self._database.writing() as session:
            coordinator_rows.release_leadership(session, self.name)

    def _has_died(self, leader: str) -> bool:
        if not leader.startswith(self._prefix):
            return False
        pid = leader.removeprefix(self._prefix).partition("-")[0]
        return pid.isdecimal() and not Path("/proc", pid).exists()


def _process_space() -> str:
    """Return a name of the processes whose numbers mean the same: those of one start of a kernel and one container."""
    try:
        boot = Path("/proc/sys/kernel/random/boot_id").read_text()
        space = f"{boot}{Path('/proc/self/ns/pid').readlink()}"
    except OSError:
        space = secrets.token_hex(16)
    return hashlib.sha256(space.encode()).hexdigest()[:12]
