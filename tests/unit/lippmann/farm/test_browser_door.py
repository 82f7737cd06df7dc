"""The browser that `--open` opens, without its link on a command line."""

from __future__ import annotations

import os
import subprocess
import threading
import webbrowser

import httpx
import pytest

from lippmann.farm.browser_door import open_browser
from tests.waiting import until

LINK = "http://127.0.0.1:8080/login?token=secret"
OTHER_USER = ["setpriv", "--reuid=65534", "--regid=65534", "--clear-groups", "--"]


@pytest.fixture
def opened(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Return the addresses on the command line of the browser."""
    addresses: list[str] = []

    def opened(address: str) -> bool:
        addresses.append(address)
        return True

    monkeypatch.setattr(webbrowser, "open", opened)
    return addresses


@pytest.mark.promise("People", "The login link of the browser that `lippmann up --open` opens is on no command line.")
def test_the_address_on_the_command_line_leads_to_the_link_once(opened: list[str]) -> None:
    made: list[str] = []

    def make_link() -> str:
        made.append(LINK)
        return LINK

    assert open_browser(make_link)
    (address,) = opened
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
def test_another_user_who_reads_the_command_line_gets_no_link(opened: list[str]) -> None:
    open_browser(lambda: LINK)
    url = httpx.URL(opened[0])
    ask = f"exec 3<>/dev/tcp/127.0.0.1/{url.port}; printf 'GET {url.path} HTTP/1.0\\r\\n\\r\\n' >&3; cat <&3"
    other = subprocess.run([*OTHER_USER, "bash", "-c", ask], capture_output=True, text=True, timeout=60)
    assert other.stdout.startswith("HTTP/1.0 403"), other
    own = subprocess.run(["bash", "-c", ask], capture_output=True, text=True, timeout=60)
    assert own.stdout.startswith("HTTP/1.0 303"), own
