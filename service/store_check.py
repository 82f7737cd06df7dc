"""Check the artifact store by storing and deleting a small file, with a time limit."""

from __future__ import annotations

import threading
import time
import uuid
from collections.abc import Callable
from contextlib import suppress

from sqlalchemy.exc import SQLAlchemyError

from lippmann.errors import LippmannError, StoreFull, StoreUnavailable
from lippmann.plan.artifact_store import ArtifactStore

CHECKS = "checks"
"""The folder of the small files in the store."""
ANSWER_S = 10.0
"""The longest time of one check; a file system that does not answer blocks its thread until it does."""
AGAIN = 1.5
"""A store that was full has room again when this many times the reserve are free, so that jobs do not stop and go."""


class StoreCheck:
    """Checks whether the store takes artifacts.

    Parameters
    ----------
    reserve_bytes
        The free space below which the store is full, bytes.
    identify
        It is called before every check, and raises StoreUnavailable if the store is not that of this farm.
    make_room
        It is called when the store is full, and returns whether it has removed something; then the store is checked
        again.
    steady
        A clock that is never set, s.
    """

    def __init__(
        self, store: ArtifactStore, *, reserve_bytes: int, answer_s: float = ANSWER_S,
        identify: Callable[[], None] = lambda: None, make_room: Callable[[], bool] = lambda: False,
        steady: Callable[[], float] = time.monotonic,
    ) -> None:  # fmt: skip
        self._store = store
        self._reserve_bytes = reserve_bytes
        self._answer_s = answer_s
        self._identify = identify
        self._make_room = make_room
        self._steady = steady
        self._lock = threading.Lock()
        self._thread: threading.Thread | None = None
        self._answer: LippmannError | None = None
        self._waits_for_database = False
        self._was_full = False

    def error(self) -> LippmannError | None:
        """Store and delete a small file, and return the error; None if the store takes artifacts.

        While the database does not answer, this is the answer of before.
        """
        with self._lock:
            if self._thread is None or not self._thread.is_alive():
                self._thread = threading.Thread(target=self._check, name="store-check", daemon=True)
                self._thread.start()
            self._thread.join(self._answer_s)
            if self._thread.is_alive():
                if self._waits_for_database:
                    return self._answer
                return StoreUnavailable(f"The artifact store does not answer within {self._answer_s:g} s.")
            return self._answer

    def _check(self) -> None:
        answer = self._try()
        if isinstance(answer, StoreFull) and self._has_made_room():
            answer = self._try()
        self._answer = answer
        self._was_full = isinstance(self._answer, StoreFull)

    def _has_made_room(self) -> bool:
        try:
            return self._make_room()
        except LippmannError:
            return False

    def _identify_again(self) -> None:
        # A database that does not answer is another fault; the store expects the id that it expected before.
        self._waits_for_database = True
        try:
            with suppress(SQLAlchemyError):
                self._identify()
        finally:
            self._waits_for_database = False

    def _try(self) -> LippmannError | None:
        name = f"{CHECKS}/{uuid.uuid4().hex}"
        try:
            self._identify_again()
            self._store.put_bytes(name, b"This file checks whether the store takes artifacts.\n")
            self._store.delete(name)
            free = self._store.free_bytes()
        except StoreFull as error:
            return StoreFull(f"The artifact store has no room left{_because(error)}.")
        except LippmannError as error:
            return StoreUnavailable(f"The artifact store cannot be written{_because(error)}.")
        least = self._reserve_bytes * (AGAIN if self._was_full else 1.0)
        if free is not None and free < least:
            return StoreFull(f"The artifact store has no room left: {free // 1_000_000} MB are free.")
        return None


def _because(error: LippmannError) -> str:
    """Return the reason that the system gives, without names of files, since health is read without a key."""
    reason = getattr(error.__cause__, "strerror", None) or error.message.partition(": ")[2]
    return f": {reason}" if reason else ""
