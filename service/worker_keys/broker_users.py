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
from redis.exceptions import NoPermissionError, RedisError, ResponseError
from redis.retry import Retry

from lippmann.errors import BadInput
from lippmann.job.messages.worker_keys import KEY_ID, WorkerKey
from service.db import access as access_rows
from service.db.engine import Database
from service.db.tables import Credential, CredentialKind
from service.errors import BrokerUnavailable

PREFIX = "lippmann-worker-"
"""The prefix of the names of these users; the id of the worker key follows."""
RIGHTS = (
    "resetchannels ~lippmann:celery:* ~lippmann:lease:* ~lippmann:stop:* ~lippmann:worker:* ~lippmann:events "
    "~lippmann:preview:* %R~lippmann:directions -@all +@connection +@transaction +brpop +del +evalsha +exists +get "
    "+llen +sadd +script|load +set +smembers +xadd +zrange -@dangerous (~lippmann:preview:* +lpush +pexpire)"
)
"""The rights of a worker, as in `deploy/broker-users.acl`. `%R~` needs Redis 7, or Valkey."""
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
        self._may_list = True
        """False if the broker refused to list its users. Then it is asked only while there are keys with users."""
        self._refusal = ""

    def make(self, key: WorkerKey) -> bool:
        """Make the user of a key, or set it right; return False if the service may not make users.

        Raises
        ------
        BadInput
            If the broker does not know the command or one of the rights.
        BrokerUnavailable
            If the broker does not answer.
        """
        digest = hashlib.sha256(key.broker_password.encode()).hexdigest()
        return self._ask("SETUSER", user_of(key.id), "reset", "on", f"#{digest}", *RIGHTS.split()) is not None

    def delete(self, key_ids: Iterable[str]) -> bool:
        """Delete the users of keys and end their connections; return False if the service may not delete users.

        Raises
        ------
        BadInput
            If the broker does not know the command.
        BrokerUnavailable
            If the broker does not answer.
        """
        names = [user_of(key_id) for key_id in key_ids]
        return not names or self._ask("DELUSER", *names) is not None

    def reconcile(self, database: Database, *, now_s: float) -> None:
        """Delete the users of keys that are not valid any more, and make again those that the broker lost.

        Raises
        ------
        BrokerUnavailable
            If the broker does not answer.
        """
        with database.reading() as session:
            rows = [row for row in access_rows.worker_keys(session) if row.has_broker_user]
        is_due = self._steady() - self._checked_s > CHECK_S
        revoked = [row.id for row in rows if row.revoked_s is not None]
        try:
            if revoked and self.delete(revoked):
                with database.writing() as session:
                    access_rows.delete_revoked_worker_keys(session, revoked)
            if is_due and (rows or self._may_list):
                self._check(database, rows, now_s=now_s)
        except BadInput as error:
            if error.message != self._refusal:
                log.warning("the users of worker keys are not kept", error=error.message)
            self._refusal, self._may_list = error.message, False
        if is_due:
            self._checked_s = self._steady()

    def _check(self, database: Database, rows: Sequence[Credential], *, now_s: float) -> None:
        listed = self._ask("USERS")
        self._may_list = listed is not None
        present = {name.decode(errors="replace") for name in listed or ()}
        for row in rows:
            is_present = user_of(row.id) in present
            # Another process may have revoked the key since the rows were read.
            if (is_present and row.id in self._right) or not _is_valid(database, row.id, now_s=now_s):
                continue
            if self.make(key_of(row)):
                self._right.add(row.id)
                log.info("a user of the broker is set right", key=row.id, name=row.name, was_lost=not is_present)
        # A row is there before its user is made, so a user without one is none that is just being made.
        ids = (name.removeprefix(PREFIX) for name in sorted(present) if name.startswith(PREFIX))
        gone = [one for one in ids if KEY_ID.fullmatch(one) and not _is_valid(database, one, now_s=now_s)]
        if gone and self.delete(gone):
            log.info("users of the broker whose keys are not valid are deleted", keys=gone)

    def close(self) -> None:
        """Close every connection."""
        self._redis.close()

    def _ask(self, *command: str) -> Any:
        """Return the answer to a command about users; None if the service has no right to it."""
        try:
            redis_client: Any = self._redis  # which has no types for commands by name
            return redis_client.execute_command("ACL", *command)
        except NoPermissionError as error:
            log.info("the service may not change the users of the broker", error=str(error))
            return None
        except ResponseError as error:
            raise BadInput(
                "LIPPMANN_REDIS_URL: expected a broker that makes users for worker keys, Redis 7 or later or Valkey, "
                f"got: {error}"
            ) from error
        except (RedisError, OSError) as error:
            raise BrokerUnavailable(f"the broker does not answer: {error}") from error


def user_of(key_id: str) -> str:
    """Return the name of the user of a worker key at the broker."""
    return PREFIX + key_id


def _is_valid(database: Database, key_id: str, *, now_s: float) -> bool:
    with database.reading() as session:
        row = access_rows.credential(session, key_id)
    if row is None or row.kind != CredentialKind.WORKER or row.revoked_s is not None or not row.has_broker_user:
        return False
    return row.expires_s is None or row.expires_s >= now_s


def key_of(row: Credential) -> WorkerKey:
    """Return a worker key as its row has it."""
    return WorkerKey(row.id, bytes.fromhex(row.secret_sha256))
