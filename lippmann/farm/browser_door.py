"""Open a browser at a secret link that is on no command line, which all users of a machine see.

The command line has the address of a server of this process. It leads one request to the link, and only a request of
the same user: Linux says whose socket asks.
"""

from __future__ import annotations

import os
import secrets
import socket
import sys
import threading
from collections.abc import Callable
from contextlib import suppress
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path

_TCP = Path("/proc/net/tcp")
_LOCAL, _REMOTE, _USER = 1, 2, 7
"""The columns of the table of sockets."""
_READ_S = 2.0
"""The time that a request may take to arrive."""


def open_browser(make_link: Callable[[], str], open_at: Callable[[str], bool]) -> bool:
    """Open a browser at a link and return whether there is one.

    Parameters
    ----------
    make_link
        Makes the link when the browser asks, from a thread of its own.
    open_at
        Opens a browser at a URL, and returns whether there is one.
    """
    if not _TCP.exists():
        return open_at(make_link())
    door = _Door(make_link)
    threading.Thread(target=door.serve, name="browser-door", daemon=True).start()
    return open_at(door.url)


class _Door(HTTPServer):
    """Leads the first request of this user to a link."""

    def __init__(self, make_link: Callable[[], str]) -> None:
        super().__init__(("127.0.0.1", 0), _Request)
        self.path = f"/{secrets.token_urlsafe(16)}"
        self.url = f"http://127.0.0.1:{self.server_address[1]}{self.path}"
        self.make_link = make_link
        self.is_used = False

    def serve(self) -> None:
        """Answer until the link was given away."""
        with self:
            while not self.is_used:
                self.handle_request()

    def handle_error(self, *_: object) -> None:
        """Say nothing: the terminal is that of the farm, and the browser says that it got no answer."""


class _Request(BaseHTTPRequestHandler):
    server: _Door
    timeout = _READ_S

    def do_GET(self) -> None:
        here, there = self.request.getsockname(), self.client_address
        if self.path != self.server.path or _user_of(there, here) != os.geteuid():
            self.send_error(HTTPStatus.FORBIDDEN)
            return
        link = self.server.make_link()
        self.server.is_used = True
        self.send_response(HTTPStatus.SEE_OTHER)
        self.send_header("Location", link)
        self.send_header("Cache-Control", "no-store")
        self.end_headers()

    def log_message(self, *_: object) -> None:
        """Say nothing: the terminal is that of the farm."""


def _user_of(local: tuple[str, int], remote: tuple[str, int]) -> int | None:
    """Return the user of the socket of this machine that connects two addresses of IPv4."""
    wanted = _hexadecimal(local), _hexadecimal(remote)
    with suppress(OSError):
        for line in _TCP.read_text().splitlines()[1:]:
            columns = line.split()
            if (columns[_LOCAL], columns[_REMOTE]) == wanted:
                return int(columns[_USER])
    return None


def _hexadecimal(address: tuple[str, int]) -> str:
    """Return an address as the table has it.

    >>> _hexadecimal(("127.0.0.1", 8080))
    '0100007F:1F90'
    """
    host, port = address
    return f"{int.from_bytes(socket.inet_aton(host), sys.byteorder):08X}:{port:04X}"
