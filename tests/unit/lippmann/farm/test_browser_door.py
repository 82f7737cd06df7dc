"""The browser that `--open` opens, without its link on a command line."""

from __future__ import annotations

import os
import subprocess
import threading

import httpx
import pytest

from lippmann.farm.browser_door import open_browser
from tests.waiting import until

LINK = "http://127.0.0.1:8080/login?token=secret"
OTHER_USER = ["setpriv", "--reuid=65534", "--regid=65534", "--clear-groups", "--"]


class Browser:
    """A browser that opens nothing."""

    def __init__(self) -> None:
        self.addresses: list[str] = []
        """The addresses on its command lines."""

    def open_at(self, address: str) -> bool:
        self.addresses.append(address)
        return True


@pytest.mark.promise("People", "The login link of the browser that `lippmann up --open` opens is on no command line.")
def test_the_address_on_the_command_line_leads_to_the_link_once() -> None:
    made: list[str] = []
    browser = Browser()

    def make_link() -> str:
        made.append(LINK)
        return LINK

    assert open_browser(make_link, browser.open_at)
    (address,) = browser.addresses
    assert "secret" not in address
    assert made == [], "the time of the link begins when the browser asks"
    assert httpx.get(f"{address}x").status_code == 403
    answer = httpx.get(address)
    assert (answer.status_code, answer.headers["Location"]) == (303, LINK)
    until(lambda: "browser-door" not in {thread.name for thread in threading.enumerate()})
    with pytest.raises(httpx.ConnectError):
        httpx.get(address)
    assert made == [LINK]


@pytest.mark.skipif(os.geteuid() != 0, reason="only root becomes another user")
def test_another_user_who_reads_the_command_line_gets_no_link() -> None:
    browser = Browser()
    open_browser(lambda: LINK, browser.open_at)
    url = httpx.URL(browser.addresses[0])
    ask = f"exec 3<>/dev/tcp/127.0.0.1/{url.port}; printf 'GET {url.path} HTTP/1.0\\r\\n\\r\\n' >&3; cat <&3"
    other = subprocess.run([*OTHER_USER, "bash", "-c", ask], capture_output=True, text=True, timeout=60)
    assert other.stdout.startswith("HTTP/1.0 403"), other
    own = subprocess.run(["bash", "-c", ask], capture_output=True, text=True, timeout=60)
    assert own.stdout.startswith("HTTP/1.0 303"), own
