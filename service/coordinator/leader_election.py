"""Leader election: a row with a deadline that the leader renews, and a shorter deadline on this machine's own clock.

A leader whose process has died on this machine is replaced at once, so that a farm that was killed goes on as soon as
it is started again.

A process that was stopped may go on in the middle of a round, long after another one has become the leader. So every
write transaction of the coordinator proves that its process leads (`LeaderElection.prove`): no process can become the
leader before the transaction has ended, because there is a single writer.
"""

from __future__ import annotations

import hashlib
import os
import platform
import secrets
import time
from collections.abc import Callable
from pathlib import Path

from sqlalchemy.orm import Session

from service.db import coordinator as coordinator_rows
from service.db.engine import Database
from service.errors import NotLeading

SAFETY = 0.9
"""The part of its time to live for which a leader believes that it leads, so that two processes never both do."""
RENEWED = 0.25
"""The part of its time to live after which a leader renews."""


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
        self._due_s = float("-inf")

    @property
    def is_leader(self) -> bool:
        """True if this process leads now; it becomes False on its own if the row is not renewed in time."""
        return self._steady() < self._until_s

    @property
    def is_due(self) -> bool:
        """True if a leader has to renew, and always for a process that does not lead."""
        return not self.is_leader or self._steady() >= self._due_s

    def renew(self, *, now_s: float) -> bool:
        """Become or remain the leader; return whether this process leads."""
        # The deadline counts from before the row was written.
        begun_s = self._steady()
        won = (self.is_leader or self._may_lead(now_s)) and self._acquire(now_s)
        self._until_s = begun_s + SAFETY * self._ttl_s if won else float("-inf")
        self._due_s = begun_s + RENEWED * self._ttl_s
        return won

    def prove(self, session: Session) -> None:
        """Check in a write transaction that this process leads, which it then does until the transaction has ended.

        Raises
        ------
        NotLeading
            If another process leads, or any may.
        """
        if not coordinator_rows.is_led_by(session, self.name):
            self._until_s = float("-inf")
            raise NotLeading

    def step_down(self) -> None:
        """Allow another process to lead at once."""
        self._until_s = float("-inf")
        with self._database.writing() as session:
            coordinator_rows.release_leadership(session, self.name)

    def _may_lead(self, now_s: float) -> bool:
        """Return whether nobody else seems to lead; candidates ask often, and must not keep the writer waiting."""
        with self._database.reading() as session:
            leader = coordinator_rows.leader(session, now_s=now_s)
        return leader is None or leader == self.name or self._has_died(leader)

    def _acquire(self, now_s: float) -> bool:
        with self._database.writing() as session:
            leader = coordinator_rows.current(session).leader
            if leader is not None and self._has_died(leader):
                coordinator_rows.release_leadership(session, leader)
            shared_s = coordinator_rows.clock_s(session, local_s=now_s)
            return coordinator_rows.acquire_leadership(
                session, self.name, now_s=shared_s, until_s=shared_s + self._ttl_s
            )  # fmt: skip

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
