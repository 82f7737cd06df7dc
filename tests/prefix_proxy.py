"""A reverse proxy that serves a service under a path, as nginx does."""

from __future__ import annotations

import re
import ssl
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from threading import Thread
from typing import Any

import httpx

from tests.waiting import ENOUGH_S

_HOP_BY_HOP = re.compile(r"connection|keep-alive|transfer-encoding|date", re.IGNORECASE)


class PrefixProxy(ThreadingHTTPServer):
    """A proxy on a loopback port.

    Parameters
    ----------
    prefix
        The path under which it serves the service; below other paths there is another site.
    removes
        Whether it removes the prefix from the paths that it forwards.
    port
        The port to listen on; 0 takes a free one.
    tls
        What it speaks TLS with.
    """

    daemon_threads = True
    upstream = ""
    """The URL of the service."""

    def __init__(self, prefix: str, *, removes: bool, port: int = 0, tls: ssl.SSLContext | None = None) -> None:
        super().__init__(("127.0.0.1", port), _Handler)
        self.prefix, self.removes = prefix, removes
        self.scheme = "https" if tls else "http"
        if tls:
            self.socket = tls.wrap_socket(self.socket, server_side=True)
        self.origin = f"{self.scheme}://127.0.0.1:{self.server_address[1]}"
        self.url = self.origin + prefix


class _Handler(BaseHTTPRequestHandler):
    server: PrefixProxy

    def log_message(self, format: str, *arguments: Any) -> None:  # noqa: A002 - as the base class calls it
        """Log nothing."""

    def _forward(self) -> None:
        proxy = self.server
        if not f"{self.path}/".startswith(f"{proxy.prefix}/"):
            self.send_error(404, "another site")
            return
        path = (self.path.removeprefix(proxy.prefix) or "/") if proxy.removes else self.path
        body = self.rfile.read(int(self.headers.get("Content-Length", 0)))
        forwarded = {"X-Forwarded-For": self.client_address[0], "X-Forwarded-Proto": proxy.scheme}
        headers = [*self.headers.items(), *forwarded.items()]
        with (
            httpx.Client(timeout=ENOUGH_S) as client,
            client.stream(self.command, proxy.upstream + path, headers=headers, content=body) as answer,
        ):
            self.send_response_only(answer.status_code)
            for name, value in answer.headers.multi_items():
                if not _HOP_BY_HOP.fullmatch(name):
                    self.send_header(name, value)
            self.end_headers()
            with suppress(OSError, httpx.HTTPError):  # one of the two ended the connection
                for data in answer.iter_raw():
                    self.wfile.write(data)

    do_GET = do_HEAD = do_POST = do_PATCH = do_DELETE = _forward  # noqa: N815 - as the base class calls them


@contextmanager
def prefix_proxy(prefix: str, *, removes: bool = True) -> Iterator[PrefixProxy]:
    """Run a proxy while the context lasts; its `upstream` is still to be set."""
    with PrefixProxy(prefix, removes=removes) as proxy:
        thread = Thread(target=proxy.serve_forever, kwargs={"poll_interval": 0.05}, daemon=True)
        thread.start()
        try:
            yield proxy
        finally:
            proxy.shutdown()
            thread.join(ENOUGH_S)
