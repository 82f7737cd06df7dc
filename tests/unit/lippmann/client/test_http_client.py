"""Which services are reached through the proxies of the environment."""

from __future__ import annotations

import sys
import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import pytest

from lippmann.client.address import Address
from lippmann.client.direct import NotDirect, StoreServer
from lippmann.client.http_client import is_this_machine
from lippmann.client.transport import Transport
from lippmann.errors import BadInput

VARIABLES = ("HTTP_PROXY", "HTTPS_PROXY", "ALL_PROXY", "NO_PROXY")


class _Answers(BaseHTTPRequestHandler):
    def do_GET(self) -> None:
        self.send_response(200)
        self.send_header("Content-Length", "0")
        self.send_header("X-Asked", self.path)
        self.end_headers()

    def log_message(self, *_: object) -> None:
        """Say nothing."""


@pytest.fixture
def url() -> Iterator[str]:
    """The URL of a server on this machine."""
    with ThreadingHTTPServer(("127.0.0.1", 0), _Answers) as server:
        thread = threading.Thread(target=server.serve_forever, args=(0.01,))
        thread.start()
        try:
            yield f"http://127.0.0.1:{server.server_address[1]}"
        finally:
            server.shutdown()
            thread.join()


@pytest.fixture(autouse=True)
def _no_proxies(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in VARIABLES:
        monkeypatch.delenv(name, raising=False)
        monkeypatch.delenv(name.lower(), raising=False)


@pytest.mark.parametrize("variable", ["HTTP_PROXY", "ALL_PROXY", "http_proxy"])
@pytest.mark.parametrize("proxy", ["http://127.0.0.1:1", "socks5://127.0.0.1:1", "socks://127.0.0.1:1"])
@pytest.mark.parametrize("host", ["127.0.0.1", "localhost"])
def test_a_service_on_this_machine_is_reached_without_a_proxy(
    url: str, variable: str, proxy: str, host: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(variable, proxy)
    transport = Transport(Address(url.replace("127.0.0.1", host), "key"), patience_s=0.0)
    assert transport.request("GET", "/health").headers["X-Asked"] == "/health"
    transport.close()


def test_a_service_on_another_machine_is_reached_through_the_proxy(url: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HTTP_PROXY", url)
    transport = Transport(Address("http://farm.invalid", "key"), patience_s=0.0)
    assert transport.request("GET", "/health").headers["X-Asked"] == "http://farm.invalid/health"
    transport.close()


@pytest.mark.parametrize(
    ("proxy", "got"),
    [
        ("socks5://127.0.0.1:1", "the 'socksio' package is not installed"),
        ("socks://127.0.0.1:1", "Unknown scheme"),
        ("http://[::1", "Invalid port"),
    ],
)
def test_a_proxy_that_cannot_be_used_is_refused(proxy: str, got: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ALL_PROXY", proxy)
    monkeypatch.setitem(sys.modules, "socksio", None)
    with pytest.raises(BadInput, match=f"expected proxies with http:// or https:// in .*ALL_PROXY, got: .*{got}"):
        Transport(Address("http://farm.invalid", "key"))
    server = StoreServer(needs_https=False)
    with pytest.raises(NotDirect), server.streamed("http://bucket.invalid/a", start=0, etag='"a"'):
        pass
    assert not server.is_reachable


def test_a_store_on_this_machine_is_reached_without_a_proxy(url: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HTTP_PROXY", "http://127.0.0.1:1")
    server = StoreServer(needs_https=False)
    with server.streamed(f"{url}/a", start=0, etag='"a"') as response:
        assert response.headers["X-Asked"] == "/a"
    server.close()


@pytest.mark.parametrize(
    ("host", "expected"),
    [("127.0.0.1", True), ("127.9.9.9", True), ("::1", True), ("localhost", True), ("10.0.0.1", False), ("", False),
     ("localhost.example.org", False)],
)  # fmt: skip
def test_the_names_and_addresses_of_this_machine_are_known(host: str, expected: bool) -> None:
    assert is_this_machine(host) is expected
