"""The socket on which the service listens."""

from __future__ import annotations

import errno
import socket

from lippmann.errors import BadInput

_BACKLOG = 512


def listening_socket(host: str, port: int) -> socket.socket:
    """Open a listening socket. Port 0 takes a free port.

    Raises
    ------
    BadInput
        If another program listens there, or the address does not belong to this machine.
    """
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(
            host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
        )[0]
    except socket.gaierror as error:
        raise BadInput(f"--host: expected an address of this machine, got {host!r}: {error.strerror}") from error
    listening = socket.socket(family, kind, protocol)
    listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listening.bind(address)
        listening.listen(_BACKLOG)
    except OSError as error:
        listening.close()
        raise BadInput(_refusal(host, port, error)) from error
    return listening


def url_of(listening: socket.socket) -> str:
    """Return the URL at which programs on this machine reach a listening socket."""
    host, port = listening.getsockname()[:2]
    if host in ("0.0.0.0", "::"):  # noqa: S104 - compared, not bound
        host = "127.0.0.1"
    return f"http://[{host}]:{port}" if ":" in host else f"http://{host}:{port}"


def _refusal(host: str, port: int, error: OSError) -> str:
    if error.errno == errno.EADDRINUSE:
        return f"--port: expected a free port, got {host}:{port}, where another program listens (0 takes a free one)"
    return f"expected an address to listen on, got {host}:{port}: {error.strerror}"
