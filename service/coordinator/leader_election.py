"""One clerk at a time: a row that is renewed, and a deadline on this machine's own clock."""

from __future__ import annotations

import os
import platform
import secrets
import time

from service.db import coordinator as clerk_rows
from service.db.engine import Database


class Leadership:
    """Whether this clerk leads."""

    def __init__(self, database: Database, *, ttl_s: float) -> None:
        self.name = f"{platform.node()}-{os.getpid()}-{secrets.token_hex(3)}"
        self._database = database
        self._ttl_s = ttl_s
        self._until_s = float("-inf")

    @property
    def is_held(self) -> bool:
        """Whether this clerk leads just now; false by itself when the row could not be renewed in time."""
        return time.monotonic() < self._until_s

    def renew(self, *, now_s: float) -> bool:
        """Become or stay the leader."""
        # Counted from before the row was written, and a little short: two clerks never both believe.
        begun_s = time.monotonic()
        with self._database.writing() as session:
            won = clerk_rows.lead(session, self.name, now_s=now_s, until_s=now_s + self._ttl_s)
        self._until_s = begun_s + 0.9 * self._ttl_s if won else float("-inf")
        return won

    def step_down(self) -> None:
        """Let another lead at once."""
        self._until_s = float("-inf")
        with self._database.writing() as session:
            clerk_rows.step_down(session, self.name)
