"""Errors in a browser: a page for who opens an address, and problem details for all others."""

from __future__ import annotations

import pytest

from tests.builders_service import Client

BROWSER = "text/html,application/xhtml+xml,application/xml;q=0.9,*/*;q=0.8"


@pytest.mark.parametrize(
    ("path", "status", "said"),
    [
        ("/nowhere", 404, "there is nothing at this address"),
        ("/api/v1/nowhere", 404, "there is nothing at this address"),
        ("/api/v1/jobs", 401, "A key is required"),
        ("/login?token=used", 401, "this login link was used or has expired"),
        ("/api/v1/links/job/video/views.mp4?token=old", 401, "this link is invalid or has expired"),
        ("/logout", 405, "expected POST, got GET"),
    ],
)
def test_a_browser_gets_a_page_and_others_a_problem(stranger: Client, path: str, status: int, said: str) -> None:
    page = stranger.get(path, headers={"Accept": BROWSER})
    assert (page.status_code, page.headers["Content-Type"]) == (status, "text/html; charset=utf-8")
    assert said in page.text
    assert "default-src 'none'" in page.headers["Content-Security-Policy"]
    assert page.headers["X-Request-Id"] in page.text
    assert ("Log in" in page.text) is (status == 401)
    for accept in ("*/*", "application/json", None):
        problem = stranger.get(path, headers={"Accept": accept} if accept else {})
        assert (problem.status_code, problem.headers["Content-Type"]) == (status, "application/problem+json")
        assert said in problem.json()["detail"]
    assert page.headers["Vary"] == problem.headers["Vary"] == "Accept"
    assert page.headers.get("WWW-Authenticate") == problem.headers.get("WWW-Authenticate")


def test_a_page_shows_text_of_a_request_as_text(stranger: Client) -> None:
    page = stranger.get("/static/<script>alert(1)</script>", headers={"Accept": BROWSER})
    assert page.status_code == 404
    assert "<script" not in page.text
    assert "&lt;script&gt;" in page.text


def test_the_page_of_a_used_login_link_leads_to_the_login(guest: Client) -> None:
    # The fixture has logged in with a link; another browser opens a wrong one.
    guest.cookies.clear()
    page = guest.get("/login", params={"token": "x"}, headers={"Accept": BROWSER})
    assert (page.status_code, 'href="/"' in page.text) == (401, True)
