"""Which URLs and addresses a webhook may go to.

A URL comes from a user, so the farm must not reach for it where only the farm can reach: this machine, its network, the
services of a cloud. A name is resolved once, every address is checked, and the connection goes to a checked address.
"""

from __future__ import annotations

import re
import socket
from dataclasses import dataclass
from ipaddress import IPv4Address, IPv6Address, ip_address, ip_network
from urllib.parse import urlsplit

from service.settings import Settings

MAX_URL = 2000
"""The length of the longest URL of a webhook."""
MAX_ADDRESSES = 4
"""The number of addresses of a host that are tried."""
_URL = re.compile(r"[!-~]+")
_HOST = re.compile(r"[A-Za-z0-9._:-]{1,253}")
_NAT64 = ip_network("64:ff9b::/96")
_PORTS = {"https": 443, "http": 80}


class ReceiverRefused(Exception):
    """A webhook may not go to this URL or address; trying again does not help."""


@dataclass(frozen=True)
class ReceiverRules:
    """The URLs and addresses that the farm allows.

    Parameters
    ----------
    own_hosts
        The hosts, in lower case, that may have addresses which are not public.
    allows_http
        True if a receiver needs no TLS.
    """

    own_hosts: frozenset[str] = frozenset()
    allows_http: bool = False


def rules_of(settings: Settings) -> ReceiverRules:
    """Return what the settings of a farm allow."""
    names = frozenset(name.strip().lower() for name in settings.webhook_hosts.split(",") if name.strip())
    return ReceiverRules(own_hosts=names, allows_http=settings.webhook_http)


@dataclass(frozen=True)
class Receiver:
    """The parts of the URL of a webhook."""

    is_tls: bool
    host: str
    """The host in lower case, an IPv6 address without brackets."""
    port: int
    place: str
    """The host and the port as the URL has them."""
    target: str
    """The path and the query."""


def parse_receiver(url: str, rules: ReceiverRules) -> Receiver:
    """Return the parts of the URL of a webhook.

    Raises
    ------
    ReceiverRefused
        If it is no URL of a webhook, or names an address that is not public.
    """
    schemes = ("https", "http") if rules.allows_http else ("https",)
    expected = f"expected a URL such as {schemes[-1]}://host/path"
    if len(url) > MAX_URL or not _URL.fullmatch(url):
        raise ReceiverRefused(f"{expected} of at most {MAX_URL} ASCII characters")
    try:
        parts = urlsplit(url)
        port, host = parts.port, (parts.hostname or "").lower()
    except ValueError as error:
        raise ReceiverRefused(f"{expected}: {error}") from error
    if parts.scheme not in schemes:
        raise ReceiverRefused(f"{expected}, got the scheme {parts.scheme!r}")
    if "@" in parts.netloc or parts.fragment:
        raise ReceiverRefused(f"{expected} without a user, a password and a fragment")
    if not _HOST.fullmatch(host) or port == 0:
        raise ReceiverRefused(f"{expected}, got another host or port")
    target = (parts.path or "/") + (f"?{parts.query}" if parts.query else "")
    receiver = Receiver(parts.scheme == "https", host, port or _PORTS[parts.scheme], parts.netloc, target)
    try:
        address = ip_address(host)
    except ValueError:
        return receiver  # A name is checked when it is resolved.
    _check_address(receiver, address, rules)
    return receiver


def resolve(receiver: Receiver, rules: ReceiverRules) -> tuple[str, ...]:
    """Return the addresses of a receiver, each of which a webhook may go to.

    Raises
    ------
    ReceiverRefused
        If any address of the host is not public, and no setting names the host.
    OSError
        If the host has no address now.
    """
    found = socket.getaddrinfo(receiver.host, receiver.port, type=socket.SOCK_STREAM)
    addresses = dict.fromkeys(str(place[0]) for *_, place in found)
    for address in addresses:
        _check_address(receiver, ip_address(address), rules)
    return tuple(addresses)[:MAX_ADDRESSES]


def _check_address(receiver: Receiver, address: IPv4Address | IPv6Address, rules: ReceiverRules) -> None:
    if receiver.host not in rules.own_hosts and not is_public(address):
        # The address stays untold: who may submit jobs need not learn the names of the network.
        raise ReceiverRefused(f"the address of {receiver.host} is not public, and the farm does not name this host")


def is_public(address: IPv4Address | IPv6Address) -> bool:
    """Return whether an address is one of the public internet, also of an IPv4 address inside an IPv6 address.

    >>> is_public(ip_address("::ffff:169.254.169.254"))
    False
    """
    if isinstance(address, IPv6Address):
        inner = address.ipv4_mapped or address.sixtofour
        if address in _NAT64:
            inner = IPv4Address(int(address) & 0xFFFF_FFFF)
        if inner is not None:
            return is_public(inner)
        if address.is_site_local or address.scope_id:
            return False
    return address.is_global and not (address.is_multicast or address.is_reserved or address.is_unspecified)
