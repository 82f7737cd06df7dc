"""The page of the API: it shows all of openapi.json, to callers with a key, and without a script."""

from __future__ import annotations

import html
import re

from tests.builders_service import Client

_ANCHOR = re.compile(r'<article id="([^"]+)"')
_TARGET = re.compile(r'href="#([^"]+)"')


def test_the_page_has_every_operation_and_every_shape_of_the_contract_and_no_dead_link(api: Client) -> None:
    described, text = api.get("/api/v1/openapi.json").json(), api.get("/docs").text
    operations = [
        (method.upper(), path, one["operationId"])
        for path, methods in described["paths"].items()
        for method, one in methods.items()
    ]
    anchors = _ANCHOR.findall(text)
    assert len(anchors) == len(set(anchors))
    messages = {one["operationId"] for methods in described["webhooks"].values() for one in methods.values()}
    assert set(anchors) == {name for *_, name in operations} | messages | set(described["components"]["schemas"])
    for method, path, _ in operations:
        assert f'<span class="method">{method}</span> <code>{path}</code>' in text
    assert set(_TARGET.findall(text)) <= set(anchors)


def test_the_page_has_the_names_and_the_words_of_parameters_fields_and_responses(api: Client) -> None:
    described, text = api.get("/api/v1/openapi.json").json(), html.unescape(api.get("/docs").text)
    for schema in described["components"]["schemas"].values():
        for name in schema.get("properties", {}):
            assert f"<td><code>{name}</code>" in text
    for methods in described["paths"].values():
        for one in methods.values():
            for parameter in one.get("parameters", ()):
                assert f"<td><code>{parameter['name']}</code>" in text
    assert "The range lies outside the file" in text


def test_the_page_needs_no_script_and_nothing_from_elsewhere(api: Client) -> None:
    answer = api.get("/docs")
    assert answer.headers["Content-Type"].startswith("text/html")
    assert "script-src 'self';" in answer.headers["Content-Security-Policy"]
    assert not re.search(r"<script|<style|style=|\bon\w+=|https?://", answer.text)
    for address in re.findall(r'(?:src|href)="(/static/[^"]+)"', answer.text):
        assert api.get(address).status_code == 200


def test_a_stranger_gets_no_page(stranger: Client) -> None:
    assert stranger.get("/docs").status_code == 401
    page = stranger.get("/docs", headers={"Accept": "text/html"})
    assert (page.status_code, "Log in" in page.text, "openapi" in page.text) == (401, True, False)


def test_a_browser_session_gets_the_page(guest: Client) -> None:
    assert "The HTTP API" in guest.get("/docs", headers={"Accept": "text/html"}).text
