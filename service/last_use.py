"""When keys and sessions were used last. Requests only note it in memory, so that none of them waits for a write."""

from __future__ import annotations

import threading

from sqlalchemy.exc import SQLAlchemyError

from service.db import access as access_rows
from service.db.engine import Database

WRITE_S = 30.0
"""The interval at which the times are written."""


class LastUse:
    """The times of the last use that are not in the database yet."""

    def __init__(self, database: Database) -> None:
        self._database = database
        self._used_s: dict[str, float] = {}
        self._lock = threading.Lock()

    def note(self, *credential_ids: str, now_s: float) -> None:
        """Note the use of a key, and of the session that it opened."""
        with self._lock:
            self._used_s |= dict.fromkeys(credential_ids, now_s)

    def write(self) -> None:
        """Write the times; if the database cannot be written, they are kept for the next time."""
        with self._lock:
            used_s, self._used_s = self._used_s, {}
        if not used_s:
            return
        try:
            with self._database.writing() as session:
                access_rows.set_used(session, used_s)
        except SQLAlchemyError:
            with self._lock:
                self._used_s = used_s | self._used_s
