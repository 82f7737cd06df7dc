"""The registry of worker keys: which are valid now. Every process of the service has one."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

from sqlalchemy.exc import SQLAlchemyError

from lippmann.job.messages.seals import KeyRefused, Seals, Unverifiable
from service.db import access as access_rows
from service.db.engine import Database
from service.settings import Settings
from service.worker_keys.broker_users import key_of

KNOWN_S = 1.0
"""The time for which the keys are believed without reading them again, and so the delay of a revocation."""
UNKNOWN_S = 0.2
"""The time for which an unknown key is believed to be unknown; it may be a new one."""


@dataclass(frozen=True)
class _Known:
    message_key: bytes
    expires_s: float | None


class WorkerKeys:
    """The worker keys of a farm, as the database has them; the last known ones while it does not answer.

    Parameters
    ----------
    needed
        True if a worker without a key is refused.
    note_use
        Called with the id of a key whenever a message of it is accepted, and the time.
    """

    def __init__(
        self,
        database: Database,
        *,
        needed: bool = False,
        note_use: Callable[[str, float], None] = lambda key_id, now_s: None,
        clock: Callable[[], float] = time.time,
        steady: Callable[[], float] = time.monotonic,
    ) -> None:
        self._database = database
        self._needed = needed
        self._note_use = note_use
        self._clock = clock
        self._steady = steady
        self._lock = threading.Lock()
        self._known: Mapping[str, _Known] = {}
        self._read_s = float("-inf")
        self._is_read = False
        """False if the database did not answer when the keys were to be read last."""

    def seals(self, settings: Settings) -> Seals:
        """Return the seals of the service, which verify the keys of workers."""
        return replace(settings.seals, find_worker_key=self.message_key)

    def message_key(self, key_id: str | None) -> bytes:
        """Return what verifies the messages of a worker key; nothing for a worker without a key, if it needs none.

        Raises
        ------
        KeyRefused
            If the key is unknown, was revoked or has expired, or if it is missing and workers need one.
        Unverifiable
            If the key is unknown while the database does not answer. Then it may be a valid one.
        """
        if key_id is None:
            if self._needed:
                raise KeyRefused("it has no worker key, and LIPPMANN_WORKERS_NEED_KEYS is set")
            return b""
        found, now_s = self._find(key_id), self._clock()
        if found is None and not self._is_read:
            raise Unverifiable(f"the worker key {key_id[:32]} cannot be verified, since the database does not answer")
        if found is None:
            raise KeyRefused(f"its worker key {key_id[:32]} was revoked, or is none of this farm")
        if found.expires_s is not None and found.expires_s < now_s:
            raise KeyRefused(f"its worker key {key_id[:32]} has expired")
        self._note_use(key_id, now_s)
        return found.message_key

    def _find(self, key_id: str) -> _Known | None:
        with self._lock:
            age_s = self._steady() - self._read_s
            if age_s > (UNKNOWN_S if self._is_read and key_id not in self._known else KNOWN_S):
                self._read()
            return self._known.get(key_id)

    def _read(self) -> None:
        try:
            with self._database.reading() as session:
                rows = access_rows.worker_keys(session)
        except SQLAlchemyError:  # after the seconds that this may take, and others need not wait for the same
            self._read_s, self._is_read = self._steady(), False
            return
        self._read_s, self._is_read = self._steady(), True
        self._known = {row.id: _Known(key_of(row).message_key, row.expires_s) for row in rows if row.revoked_s is None}
