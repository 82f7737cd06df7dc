"""The URLs and addresses to which a webhook may go."""

from __future__ import annotations

import socket
from typing import Any

import pytest

from service.webhooks.receiver import MAX_URL, ReceiverRefused, ReceiverRules, parse_receiver, resolve

RULES = ReceiverRules()
HTTP = ReceiverRules(allows_http=True)
NOT_PUBLIC = (
    "127.0.0.1", "127.9.9.9", "0.0.0.0", "10.1.2.3", "172.16.0.1", "192.168.1.1", "169.254.169.254", "100.64.0.1",
    "192.0.2.1", "198.18.0.1", "224.0.0.1", "239.1.1.1", "240.0.0.1", "255.255.255.255",
    "[::1]", "[::]", "[fe80::1]", "[fec0::1]", "[fc00::1]", "[fd00:ec2::254]", "[ff02::1]", "[2001:db8::1]",
    "[::ffff:127.0.0.1]", "[::ffff:a9fe:a9fe]", "[::127.0.0.1]", "[64:ff9b::a9fe:a9fe]", "[64:ff9b:1::1]",
    "[2002:7f00:1::1]", "[2002:a9fe:a9fe::]", "[2001:0:4136:e378:8000:63bf:80ff:fffe]",
)  # fmt: skip


@pytest.mark.parametrize("host", NOT_PUBLIC)
def test_an_address_that_is_not_public_is_refused_unless_the_farm_names_it(host: str) -> None:
    with pytest.raises(ReceiverRefused, match="not public"):
        parse_receiver(f"https://{host}/hook", RULES)
    own = ReceiverRules(own_hosts=frozenset({host.strip("[]")}))
    assert parse_receiver(f"https://{host}:8443/hook", own).port == 8443


@pytest.mark.promise(
    "People",
    "A webhook goes to no address of the own network that the farm does not name, whatever its URL looks like.",
)
@pytest.mark.parametrize("host", ["localhost", "127.1", "0x7f000001", "2130706433", "017700000001", "[::ffff:7f00:1]"])
def test_what_resolves_to_an_address_that_is_not_public_is_refused(host: str) -> None:
    with pytest.raises(ReceiverRefused, match="not public"):
        resolve(parse_receiver(f"https://{host}/", RULES), RULES)


@pytest.mark.parametrize("url", ["https://8.8.8.8/", "https://[2606:4700:4700::1111]/", "https://[2002:808:808::1]/"])
def test_a_public_address_is_accepted(url: str) -> None:
    receiver = parse_receiver(url, RULES)
    assert (receiver.is_tls, receiver.port, receiver.target) == (True, 443, "/")
    assert resolve(receiver, RULES) == (receiver.host,)


@pytest.mark.parametrize(
    "url",
    [
        "", "hook", "//8.8.8.8/", "ftp://8.8.8.8/", "file:///etc/passwd", "http://8.8.8.8/", "https://", "https:///x",
        "https://me:secret@8.8.8.8/", "https://@8.8.8.8/", "https://8.8.8.8/#part", "https://8.8.8.8:0/",
        "https://8.8.8.8:70000/", "https://8.8.8.8:x/", "https://8.8.8.8/a b", "https://8.8.8.8/\r\nX: y",
        "https://8.8.8.8/é", "https://[::1", "https://ho_st*/", "https://8.8.8.8/" + "x" * MAX_URL,
    ],
)  # fmt: skip
def test_what_is_no_url_of_a_webhook_is_refused(url: str) -> None:
    with pytest.raises(ReceiverRefused, match=r"^expected a URL such as https://host/path"):
        parse_receiver(url, RULES)


def test_the_parts_of_a_url_are_those_of_the_request() -> None:
    receiver = parse_receiver("http://Hooks.Example.org:8080/a/b?c=d", HTTP)
    assert (receiver.host, receiver.port, receiver.place, receiver.target, receiver.is_tls) == (
        "hooks.example.org", 8080, "Hooks.Example.org:8080", "/a/b?c=d", False,
    )  # fmt: skip
    assert parse_receiver("http://8.8.8.8?a", HTTP).target == "/?a"


def _answers(*addresses: str) -> Any:
    return lambda *_, **__: [(socket.AF_INET, socket.SOCK_STREAM, 6, "", (address, 443)) for address in addresses]


def test_one_address_that_is_not_public_refuses_the_host(monkeypatch: pytest.MonkeyPatch) -> None:
    receiver = parse_receiver("https://hooks.example.org/", RULES)
    monkeypatch.setattr(socket, "getaddrinfo", _answers("8.8.8.8", "10.0.0.1"))
    with pytest.raises(ReceiverRefused) as refused:
        resolve(receiver, RULES)
    assert "10.0.0.1" not in str(refused.value)
    monkeypatch.setattr(socket, "getaddrinfo", _answers("8.8.8.8", "8.8.4.4", "8.8.8.8"))
    assert resolve(receiver, RULES) == ("8.8.8.8", "8.8.4.4")
