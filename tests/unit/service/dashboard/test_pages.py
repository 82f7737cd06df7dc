"""The two pages: who sees which, and what they may load."""

from __future__ import annotations

import base64
import hashlib
import json
import re
from dataclasses import replace

import pytest

from service.dashboard.assets import PREFIX, VENDORED, assets, import_map
from tests.builders_service import Client
from tests.waiting import until

PANEL = "ws://localhost:11222/driver"
_INLINE = re.compile(r"<script(?![^>]*\bsrc=)[^>]*>(.*?)</script>", re.DOTALL)
_LOADED = re.compile(r'(?:src|href)="(/[^"#]*)"')


def policy(client: Client) -> dict[str, list[str]]:
    header = client.get("/").headers["Content-Security-Policy"]
    return {words[0]: words[1:] for words in (part.split() for part in header.split(";"))}


def test_a_stranger_is_asked_for_a_key_and_a_guest_is_not(stranger: Client, request: pytest.FixtureRequest) -> None:
    assert 'name="key"' in stranger.get("/").text
    guest: Client = request.getfixturevalue("guest")
    text = guest.get("/").text
    assert 'name="key"' not in text
    assert "page.js" in text


def test_the_page_starts_the_process_that_will_make_its_pictures(guest: Client) -> None:
    guest.get("/")
    assert until(lambda: guest.app.state.lippmann.processes.pids)  # type: ignore[attr-defined]


def test_a_page_that_sent_a_wrong_key_without_scripts_says_so(stranger: Client) -> None:
    answer = stranger.post("/login", data={"key": "lip_x_y"}, headers={"Accept": "text/html"})
    assert "This key is unknown" in answer.text
    assert "This key is unknown" not in stranger.get("/").text


def test_the_only_inline_script_is_the_import_map_and_the_policy_names_its_hash(guest: Client) -> None:
    (inline,) = _INLINE.findall(guest.get("/").text)
    assert json.loads(inline) == import_map()
    digest = base64.b64encode(hashlib.sha256(inline.encode()).digest()).decode()
    assert policy(guest)["script-src"] == ["'self'", f"'sha256-{digest}'"]


def test_the_policy_lets_nothing_in_from_elsewhere(guest: Client, stranger: Client) -> None:
    for client in (guest, stranger):
        rules = policy(client)
        assert rules["default-src"] == ["'none'"]
        assert rules["frame-ancestors"] == rules["base-uri"] == ["'none'"]
        sources = {source for name, words in rules.items() if name != "script-src" for source in words}
        assert sources == {"'none'", "'self'"}


@pytest.mark.promise(
    "People",
    "A page connects to nothing but the service and, only where the operator says so, a panel at a loopback address.",
)
def test_the_policy_lets_a_page_connect_to_the_panel_that_the_operator_names(guest: Client) -> None:
    assert policy(guest)["connect-src"] == ["'self'"]
    farm = guest.app.state  # type: ignore[attr-defined]
    farm.lippmann = replace(farm.lippmann, settings=farm.lippmann.settings.model_copy(update={"panel_url": PANEL}))
    assert policy(guest)["connect-src"] == ["'self'", "ws://localhost:11222"]
    assert f'data-panel="{PANEL}"' in guest.get("/").text
    guest.cookies.clear()
    assert policy(guest)["connect-src"] == ["'self'"]


def test_a_page_is_not_kept_and_what_it_loads_is_kept_for_a_year(guest: Client) -> None:
    page = guest.get("/")
    assert page.headers["Cache-Control"] == "no-store"
    loaded = [address for address in _LOADED.findall(page.text) if address != "/"]
    names = {address.removeprefix(PREFIX).partition("?")[0] for address in loaded}
    assert names == {"page.js", "page.css", "logo.svg", *VENDORED.values()} - {"vendor/uplot.js"}
    for address in loaded:
        answer = guest.get(address)
        assert answer.status_code == 200
        assert "immutable" in answer.headers["Cache-Control"]


@pytest.mark.parametrize("address", ["/static/app.js", "/static/app.js?v=0000000000000000"])
def test_an_address_without_the_right_hash_is_asked_for_every_time(stranger: Client, address: str) -> None:
    first = stranger.get(address)
    assert first.headers["Cache-Control"] == "no-cache"
    again = stranger.get(address, headers={"If-None-Match": first.headers["ETag"]})
    assert (again.status_code, again.content) == (304, b"")


@pytest.mark.parametrize("accepted", ["gzip", "br;q=1.0, gzip;q=0.8, *;q=0.1", "gzip;q=0.001"])
def test_a_browser_that_takes_gzip_gets_it(stranger: Client, accepted: str) -> None:
    plain = stranger.get("/static/page.js", headers={"Accept-Encoding": "identity"})
    packed = stranger.get("/static/page.js", headers={"Accept-Encoding": accepted})
    assert (packed.headers["Content-Encoding"], packed.headers["Vary"]) == ("gzip", "Accept-Encoding")
    assert "Content-Encoding" not in plain.headers
    assert packed.content == plain.content == assets()["page.js"].body
    assert int(packed.headers["Content-Length"]) < len(plain.content) / 2


@pytest.mark.parametrize("accepted", ["", "br", "gzip;q=0", "gzip; q=0.0, br", "xgzip"])
def test_others_get_what_they_take(stranger: Client, accepted: str) -> None:
    answer = stranger.get("/static/page.js", headers={"Accept-Encoding": accepted})
    assert "Content-Encoding" not in answer.headers


@pytest.mark.parametrize("name", ["nothing.js", "vendor/HASHES", "../pages.py", "..%2f__init__.py", ""])
def test_only_static_files_are_sent(stranger: Client, name: str) -> None:
    assert stranger.get(f"/static/{name}").status_code == 404
