"""Programs that watch the farm without a key: those with the token of the operator, and those at listed addresses.

Neither needs the database, so that an outage of the database can be seen.
"""

from __future__ import annotations

import hmac
from ipaddress import ip_address
from pathlib import Path

import structlog

from lippmann.errors import BadInput
from lippmann.key_file import private_bytes
from service.settings import Settings

SHORTEST_TOKEN = 20
"""The smallest length of a token, in characters; a shorter one could be guessed."""

log = structlog.get_logger("service.access")


class MonitorAccess:
    """Decides who reads the figures without a key.

    Raises
    ------
    BadInput
        If others may read the file of the token, it cannot be read, or its token is too short.
    """

    def __init__(self, settings: Settings) -> None:
        self._file = settings.metrics_token_file
        self._networks = settings.metrics_allowed_networks
        self._knows_proxies = bool(settings.proxy_networks)
        if self._file is not None:
            _check_token(self._file)

    def admits(self, *, address: str, is_forwarded: bool, authorization: str | None) -> bool:
        """Return whether a request may read the figures without a key.

        Parameters
        ----------
        address
            The address of the client, which a trusted proxy may have named.
        is_forwarded
            True if some proxy has forwarded the request. If no proxy is trusted, the address is that of the proxy and
            says nothing about the client.
        """
        if self._is_listed(address) and (self._knows_proxies or not is_forwarded):
            return True
        scheme, _, token = (authorization or "").partition(" ")
        return scheme.lower() == "bearer" and self._is_token(token.strip())

    def _is_listed(self, address: str) -> bool:
        try:
            found = ip_address(address)
        except ValueError:
            return False
        return any(found in network for network in self._networks)

    def _is_token(self, token: str) -> bool:
        if self._file is None:
            return False
        try:
            # The file is read each time, so that a token is replaced without a restart.
            right = _token(self._file)
        except BadInput as error:
            log.warning("the token of monitors is not accepted", error=error.message)
            return False
        return len(right) >= SHORTEST_TOKEN and hmac.compare_digest(token.encode(errors="replace"), right)


def _token(path: Path) -> bytes:
    return private_bytes(path, what="file of a token").strip()


def _check_token(path: Path) -> None:
    try:
        length = len(_token(path))
    except BadInput as error:
        raise BadInput(f"LIPPMANN_METRICS_TOKEN_FILE: {error.message}") from error
    if length < SHORTEST_TOKEN:
        raise BadInput(
            f"LIPPMANN_METRICS_TOKEN_FILE: expected a token of at least {SHORTEST_TOKEN} characters in {path}, "
            f"got {length}"
        )
