"""The users that worker keys have at the broker, where the service may make users.

The broker ends the connections of a user that is deleted. The database says which users there must be; a broker that
was restarted may have lost them.
"""

from __future__ import annotations

import hashlib
import time
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import redis
import structlog
from redis.backoff import NoBackoff
from redis.exceptions import RedisError, ResponseError
from redis.retry import Retry

from lippmann.job.messages.worker_keys import WorkerKey
from service.db import access as access_rows
from service.db.engine import Database
from service.db.tables import Credential
from service.errors import BrokerUnavailable

PREFIX = "lippmann-worker-"
"""The prefix of the names of these users; the id of the worker key follows."""
RIGHTS = (
    "resetchannels ~lippmann:celery:* ~lippmann:lease:* ~lippmann:stop:* ~lippmann:worker:* ~lippmann:events "
    "%R~lippmann:directions -@all +@connection +@transaction +brpop +del +evalsha +exists +get +llen +sadd "
    "+script|load +set +smembers +xadd +zrange -@dangerous"
)
"""The rights of a worker, as in `deploy/broker-users.acl`."""
CHECK_S = 10.0
"""The interval at which the users are compared with the keys, since a broker that was restarted may have lost them."""

log = structlog.get_logger("service.worker_keys")


class BrokerUsers:
    """Makes and deletes the users of worker keys at the broker."""

    def __init__(self, redis_url: str, *, timeout_s: float, steady: Callable[[], float] = time.monotonic) -> None:
        self._redis = redis.Redis.from_url(
            redis_url, protocol=2, socket_timeout=timeout_s, socket_connect_timeout=timeout_s,
            retry=Retry(NoBackoff(), 0),
        )  # fmt: skip
        self._steady = steady
        self._checked_s = float("-inf")
        self._right: set[str] = set()
        """The keys whose users this process has made or set right: those of an earlier release had other rights."""

    def make(self, key: WorkerKey) -> bool:
        """Make the user of a key, or set it right; return False if the service may not make users.

        Raises
        ------
        BrokerUnavailable
            If the broker does not answer.
        """
        digest = hashlib.sha256(key.broker_password.encode()).hexdigest()
        return self._ask("SETUSER", user_of(key.id), "reset", "on", f"#{digest}", *RIGHTS.split()) is not None

    def delete(self, key_ids: Iterable[str]) -> bool:
        """Delete the users of keys and end their connections; return False if the service may not delete users.

        Raises
        ------
        BrokerUnavailable
            If the broker does not answer.
        """
        names = [user_of(key_id) for key_id in key_ids]
        return not names or self._ask("DELUSER", *names) is not None

    def reconcile(self, database: Database, *, now_s: float) -> None:
        """Delete the users of keys that were revoked or have expired, and make again those that the broker lost.

        Raises
        ------
        BrokerUnavailable
            If the broker does not answer.
        """
        with database.reading() as session:
            rows = [row for row in access_rows.worker_keys(session) if row.has_broker_user]
        is_due = self._steady() - self._checked_s > CHECK_S
        revoked = [row.id for row in rows if row.revoked_s is not None]
        if revoked and self.delete(revoked):
            with database.writing() as session:
                access_rows.delete_revoked_worker_keys(session, revoked)
        if is_due and rows:
            self._check([row for row in rows if row.revoked_s is None], now_s=now_s)
        if is_due:
            self._checked_s = self._steady()

    def _check(self, rows: Sequence[Credential], *, now_s: float) -> None:
        present = set(self._ask("USERS") or ())
        for row in rows:
            is_valid = row.expires_s is None or row.expires_s >= now_s
            is_present = user_of(row.id).encode() in present
            if is_present and not is_valid:
                self.delete([row.id])
            elif is_valid and not (is_present and row.id in self._right) and self.make(key_of(row)):
                self._right.add(row.id)
                log.info("a user of the broker is set right", key=row.id, name=row.name, was_lost=not is_present)

    def close(self) -> None:
        """Close every connection."""
        self._redis.close()

    def _ask(self, *command: str) -> Any:
        """Return the answer to a command about users; None if the service has no right to it."""
        try:
            redis_client: Any = self._redis  # which has no types for commands by name
            return redis_client.execute_command("ACL", *command)
        except ResponseError as error:
            log.info("the service may not change the users of the broker", error=str(error))
            return None
        except (RedisError, OSError) as error:
            raise BrokerUnavailable(f"the broker does not answer: {error}") from error


def user_of(key_id: str) -> str:
    """Return the name of the user of a worker key at the broker."""
    return PREFIX + key_id


def key_of(row: Credential) -> WorkerKey:
    """Return a worker key as its row has it."""
    return WorkerKey(row.id, bytes.fromhex(row.secret_sha256))
