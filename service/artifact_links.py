"""Signed links to artifacts: whoever has one downloads one file of a job, without a key, until the link expires.

A token names its expiry and the key that made it, and is signed together with the job and the file. Nothing is stored.
"""

from __future__ import annotations

import hmac
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from lippmann.errors import BadInput
from lippmann.key_file import derived_key
from service.errors import ServiceError, Unauthorized

PURPOSE = "artifact link"
_TOKEN = re.compile(r"([1-9][0-9]{0,11})\.([0-9a-z]{1,32})\.([0-9a-f]{64})", re.ASCII)


@dataclass(frozen=True)
class ArtifactLinks:
    """Signs and verifies tokens of links.

    Parameters
    ----------
    keys
        Returns the keys of the farm for links, the signing one first, whenever a token is signed or verified.
    """

    keys: Callable[[], Sequence[bytes]]

    def token(self, job_id: str, name: str, *, expires_s: int, key_id: str) -> str:
        """Return the token of a link to a file of a job.

        Parameters
        ----------
        expires_s
            When the link expires, s since 1970.
        key_id
            The key or the browser session that makes the link.

        Raises
        ------
        ServiceError
            If the farm has no key for links.
        """
        keys = self._keys()
        if not keys:
            raise ServiceError("the farm has no key for links")
        return f"{expires_s}.{key_id}.{_signature(keys[0], job_id, name, expires_s, key_id)}"

    def maker(self, token: str, job_id: str, name: str, *, now_s: float) -> str:
        """Return the id of the key that made a link.

        Raises
        ------
        Unauthorized
            If the token was not signed for this file of this job, or has expired.
        """
        match = _TOKEN.fullmatch(token)
        if match is not None:
            expires_s, key_id, given = int(match[1]), match[2], match[3]
            signatures = [_signature(key, job_id, name, expires_s, key_id) for key in self._keys()]
            if any(hmac.compare_digest(given, signature) for signature in signatures) and now_s < expires_s:
                return key_id
        raise Unauthorized("this link is invalid or has expired; ask for a new one")

    def _keys(self) -> Sequence[bytes]:
        try:
            return self.keys()
        except BadInput as error:  # The message names a file of the farm.
            raise ServiceError("the keys of the farm for links cannot be read") from error


def _signature(key: bytes, job_id: str, name: str, expires_s: int, key_id: str) -> str:
    # Neither the job nor the file of a link that was made has a line break in its name, so no text has two readings.
    text = f"{job_id}\n{name}\n{expires_s}\n{key_id}"
    return hmac.digest(derived_key(key, PURPOSE), text.encode(), "sha256").hex()
