"""Downloads from the server of the store, to which a service redirects clients that ask for it.

The service neither reads such a file nor verifies it, so the client compares the digest that the service told before.
Where the server cannot be reached from here, or a file is not as it should be, the service itself sends the file.
"""

from __future__ import annotations

import binascii
import re
import threading
from base64 import b64decode
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from urllib.parse import urlsplit

import httpx

from lippmann.client.http_client import new_http_client
from lippmann.errors import BadInput

ASKS: Mapping[str, str] = {"Prefer": "redirect"}
"""The header with which a client asks for a redirect; services of earlier versions ignore it."""
_SHA256 = re.compile(r"(?:^|,)\s*sha-256=:([A-Za-z0-9+/=]+):")


class NotDirect(Exception):
    """The server of the store does not send a file, so the service has to."""


def expected_sha256(headers: Mapping[str, str]) -> str | None:
    """Return the SHA-256 of a whole file, in hexadecimal digits, by the Repr-Digest (RFC 9530) of an answer.

    >>> expected_sha256({"Repr-Digest": "sha-256=:47DEQpj8HBSa+/TImW+5JCeuQeRkm5NMpJWZG3hSuFU=:"})[:16]
    'e3b0c44298fc1c14'
    """
    match = _SHA256.search(headers.get("Repr-Digest", ""))
    try:
        return b64decode(match[1], validate=True).hex() if match else None
    except binascii.Error:
        return None


class StoreServer:
    """The server of the store as this client reaches it. The key of the service is never sent there.

    Parameters
    ----------
    needs_https
        True if the service itself has HTTPS: then no file comes over an open connection.
    """

    def __init__(self, *, needs_https: bool) -> None:
        self._needs_https = needs_https
        self._http: httpx.Client | None = None
        self._lock = threading.Lock()
        self.is_reachable = True
        """False once it could not be reached; it is not tried again."""

    def close(self) -> None:
        """Close every connection."""
        if self._http is not None:
            self._http.close()

    @contextmanager
    def streamed(self, url: str, *, start: int, etag: str) -> Iterator[httpx.Response]:
        """Open the file of a URL from a byte on; the status is 200, or 206, or 416 if there is no such byte.

        Raises
        ------
        NotDirect
            If the server cannot be reached, or has no file with this entity tag.
        httpx.HTTPError
            If the connection breaks.
        """
        self._check(url)
        headers = {"If-Match": etag, "Accept-Encoding": "identity"} | ({"Range": f"bytes={start}-"} if start else {})
        try:
            with self._client(url).stream("GET", url, headers=headers) as response:
                if response.status_code not in (200, 206, 416):
                    raise NotDirect(f"the server of the store answered {response.status_code}")
                yield response
        except (httpx.ConnectError, httpx.ConnectTimeout, BadInput) as error:
            self.is_reachable = False
            raise NotDirect(f"the server of the store cannot be reached: {error}") from error
        except httpx.InvalidURL as error:
            raise NotDirect(f"expected the URL of a file, got {url!r}") from error

    def _client(self, url: str) -> httpx.Client:
        with self._lock:  # Made on first use, by one of the threads that download.
            if self._http is None:
                self._http = new_http_client(url, timeout=httpx.Timeout(30.0, connect=3.0))
            return self._http

    def _check(self, url: str) -> None:
        allowed = ("https",) if self._needs_https else ("https", "http")
        if urlsplit(url).scheme not in allowed:
            raise NotDirect(f"expected a URL of {' or '.join(allowed)}, got {url!r}")
