"""Worker keys: a worker that joined by a file signs its messages with a key of its own, besides the key of the farm.

The farm stores the SHA-256 of the secret of a worker key, and the worker has the secret. The key of its messages and
its password at the broker are derived from that digest, so both sides know them. They tell nothing about the secret.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Callable
from dataclasses import dataclass

from lippmann.key_file import derived_key

WORKER_KEY = "worker_key"
"""The field of a message with the id of the worker key that signed it."""
WORKER_SEAL = "worker_seal"
"""The field of a message with the signature of that key."""
KEY_REFUSED = "worker-key"
"""The code of the fault of a worker whose key the farm refuses."""
KEY_REFUSAL = "worker-key-"
"""The beginning of the names of the stop signals that say that a worker key is refused."""
KEY_ID = re.compile(r"[0-9a-f]{12}")
_MESSAGES = "worker messages"
_PASSWORD = "worker password at the broker"  # noqa: S105 - the purpose of a derived key

FindWorkerKey = Callable[[str | None], bytes]
"""Returns what verifies the messages of a worker key, by its id; it raises `seals.KeyRefused` for a refused one."""


@dataclass(frozen=True)
class WorkerKey:
    """The key of a worker.

    Parameters
    ----------
    id
        The name of the key, 12 hexadecimal digits.
    digest
        The SHA-256 of its secret, 32 bytes.
    """

    id: str
    digest: bytes

    @classmethod
    def of_secret(cls, key_id: str, secret: str) -> WorkerKey:
        """Return a key by its secret."""
        return cls(key_id, hashlib.sha256(secret.encode()).digest())

    @property
    def message_key(self) -> bytes:
        """The key that signs the messages of the worker, 32 bytes."""
        return derived_key(self.digest, _MESSAGES)

    @property
    def broker_password(self) -> str:
        """The password of the worker's own user at the broker."""
        return derived_key(self.digest, _PASSWORD).hex()

    def instance(self, start: str) -> str:
        """Return the name of a start of the worker process, which names the key too.

        >>> WorkerKey("00112233aabb", bytes(32)).instance("f00d")
        '00112233aabb.f00d'
        """
        return f"{self.id}.{start}"


def key_of_instance(instance: object) -> str | None:
    """Return the id of the worker key in the name of a start of a worker process; None if it has none.

    >>> key_of_instance("00112233aabb.f00d"), key_of_instance("f00d"), key_of_instance(None)
    ('00112233aabb', None, None)
    """
    if not isinstance(instance, str) or "." not in instance:
        return None
    return instance.partition(".")[0]


def key_refusal(key_id: str | None) -> str:
    """Return the name of the stop signal that tells the workers of a key, or those without one, that they are refused.

    >>> key_refusal("00112233aabb"), key_refusal(None)
    ('worker-key-00112233aabb', 'worker-key-none')
    """
    return f"{KEY_REFUSAL}{key_id or 'none'}"
