"""The signatures of webhooks, in the form of the Standard Webhooks, for which receivers have libraries.

Each owner has a secret, derived from the key of the farm for links. It is stored nowhere, and it verifies the messages
of this owner's jobs only.
"""

from __future__ import annotations

import base64
import hmac
from collections.abc import Mapping, Sequence

from lippmann.key_file import derived_key

PREFIX = "whsec_"
VERSION = "v1"


def secret_of(key: bytes, owner_id: str) -> str:
    """Return the secret with which a receiver verifies the messages about the jobs of an owner."""
    return PREFIX + base64.b64encode(_secret(key, owner_id)).decode()


def signed_headers(
    keys: Sequence[bytes], owner_id: str, message_id: str, body: bytes, *, now_s: float
) -> Mapping[str, str]:
    """Return the headers of a message, with a signature for each key of the farm, so that keys can be replaced.

    Parameters
    ----------
    message_id
        The id of the message, the same in every attempt.
    now_s
        The time of this attempt, s since 1970. It is signed, so that an old message is not accepted again.
    """
    content = f"{message_id}.{int(now_s)}.".encode() + body
    digests = [hmac.digest(_secret(key, owner_id), content, "sha256") for key in keys]
    return {
        "Webhook-Id": message_id,
        "Webhook-Timestamp": str(int(now_s)),
        "Webhook-Signature": " ".join(f"{VERSION},{base64.b64encode(digest).decode()}" for digest in digests),
    }


def _secret(key: bytes, owner_id: str) -> bytes:
    return derived_key(key, f"webhook {owner_id}")
