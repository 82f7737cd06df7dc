"""A client of the HTTP library, with the proxies and the certificates of the environment.

A service on this machine is reached without a proxy: a proxy would not find it, and would read the key.
"""

from __future__ import annotations

from ipaddress import ip_address
from typing import Any

import httpx

from lippmann.errors import BadInput


def new_http_client(url: str, **options: Any) -> httpx.Client:
    """Return an HTTP client for the host of a URL; the options are those of `httpx.Client`.

    Raises
    ------
    BadInput
        If the environment names a proxy of a kind that cannot be used.
    httpx.InvalidURL, UnicodeEncodeError
        If the URL or the options are invalid.
    """
    uses_proxies = not is_this_machine(httpx.URL(url).host)
    try:
        # The certificates of SSL_CERT_FILE count for this machine, too.
        return httpx.Client(trust_env=uses_proxies, verify=httpx.create_ssl_context(), **options)
    except UnicodeEncodeError:
        raise
    except (ImportError, ValueError, httpx.InvalidURL) as error:
        expected = "proxies with http:// or https:// in the variables HTTP_PROXY, HTTPS_PROXY and ALL_PROXY"
        raise BadInput(f"expected {expected}, got: {error}") from error


def is_this_machine(host: str) -> bool:
    """Return whether a host is this machine by its name or its address.

    >>> is_this_machine("127.0.0.1"), is_this_machine("::1"), is_this_machine("farm.example.org")
    (True, True, False)
    """
    try:
        return ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"
