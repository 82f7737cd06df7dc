"""Browser sessions: their tokens are replaced, they end after a time without use, and with what opened them."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from sqlalchemy import select
from sqlalchemy.exc import OperationalError

from service.browser_sessions import OVERLAP_S
from service.db import access as access_rows
from service.db.engine import Database
from service.db.tables import AuditRow, Credential, CredentialKind
from service.routes import middleware
from tests.builders_service import Client, Farm

COOKIE = "lippmann_session"
SESSION = "/api/v1/session"
RENEW_S = 3600.0


@pytest.fixture
def browser(api: Client) -> Client:
    """Lend a client that has logged in with a key."""
    key = api.headers.pop("Authorization").removeprefix("Bearer ")
    api.post("/login", data={"key": key}, follow_redirects=False)
    return api


def _cookie(client: Client) -> str:
    return str(client.cookies[COOKIE])


def _status(client: Client, cookie: str) -> int:
    """Return the answer to a request of another browser with a cookie."""
    other = Client(client.app, raise_server_exceptions=False)
    return int(other.get(SESSION, headers={"Cookie": f"{COOKIE}={cookie}"}).status_code)


def _flush(client: Client) -> None:
    client.app.state.lippmann.last_use.write()  # type: ignore[attr-defined]


def test_the_token_is_replaced_after_a_time_of_use_and_the_session_stays_the_same(
    browser: Client, api_farm: Farm
) -> None:
    first = _cookie(browser)
    api_farm.now_s += RENEW_S - 1
    browser.get(SESSION)
    assert _cookie(browser) == first
    api_farm.now_s += 1
    browser.get(SESSION)
    second = _cookie(browser)
    assert second != first
    assert second.split(".")[0] == first.split(".")[0]
    api_farm.now_s += RENEW_S / 2
    assert browser.get(SESSION).status_code == 200
    api_farm.now_s += RENEW_S - 1
    browser.get(SESSION)
    assert _cookie(browser) == second  # an hour of use, not an hour after the offer


@pytest.mark.promise(
    "People", "The token of a browser session is replaced while it is used, and a copy of an old one ends the session."
)
def test_an_old_token_is_accepted_for_a_moment_and_then_ends_the_session(browser: Client, api_farm: Farm) -> None:
    first = _cookie(browser)
    api_farm.now_s += RENEW_S
    browser.get(SESSION)
    assert _status(browser, first) == 200  # until the browser has sent the next one
    browser.get(SESSION)
    api_farm.now_s += OVERLAP_S
    assert _status(browser, first) == 200
    api_farm.now_s += 1
    assert browser.get(SESSION).status_code == 200
    assert _status(browser, first) == 401
    assert browser.get(SESSION).status_code == 401  # somebody has had a copy
    with api_farm.database.reading() as session:
        entry = session.scalars(select(AuditRow).order_by(AuditRow.id.desc())).first()
        assert entry is not None
        assert (entry.action, entry.name) == ("end-session", "tester")


def test_a_new_token_that_gets_lost_is_followed_by_another(browser: Client, api_farm: Farm) -> None:
    first = _cookie(browser)
    api_farm.now_s += RENEW_S
    assert _status(browser, first) == 200  # the answer with the new token is lost
    browser.get(SESSION)
    assert _cookie(browser) == first  # not one for each of many requests at once
    api_farm.now_s += OVERLAP_S
    browser.get(SESSION)
    assert _cookie(browser) != first
    assert browser.get(SESSION).status_code == 200


def test_a_new_token_is_not_sent_when_another_may_have_been_made_since(
    browser: Client, api_farm: Farm, monkeypatch: pytest.MonkeyPatch
) -> None:
    first = _cookie(browser)
    api_farm.now_s += RENEW_S
    monkeypatch.setattr(middleware, "OVERLAP_S", -1.0)
    browser.get(SESSION)
    assert _cookie(browser) == first


def test_every_kind_of_answer_carries_the_new_token(browser: Client, api_farm: Farm) -> None:
    for path in ("/", "/api/v1/health", "/api/v1/scenes/ball/poster.png", "/api/v1/jobs/none"):
        before = _cookie(browser)
        api_farm.now_s += RENEW_S + OVERLAP_S
        browser.get(path)
        assert _cookie(browser) != before, path
        browser.get(SESSION)


def test_sessions_go_on_while_the_database_cannot_be_written(
    browser: Client, api_farm: Farm, monkeypatch: pytest.MonkeyPatch
) -> None:
    first = _cookie(browser)
    api_farm.now_s += RENEW_S

    def fail(_database: Database) -> None:
        raise OperationalError("UPDATE", {}, Exception("the disk is full"))

    with monkeypatch.context() as broken:
        broken.setattr(Database, "writing", fail)
        assert browser.get(SESSION).status_code == 200
    assert _cookie(browser) == first
    browser.get(SESSION)
    assert _cookie(browser) != first


def test_logging_out_with_a_token_that_is_due_leaves_no_cookie(browser: Client, api_farm: Farm) -> None:
    api_farm.now_s += RENEW_S
    browser.post("/logout", headers={"X-Lippmann-Request": "1"}, follow_redirects=False)
    assert COOKIE not in browser.cookies


@pytest.mark.promise("People", "A browser session ends after a time without requests.")
def test_a_session_ends_after_a_time_without_requests(browser: Client, api_farm: Farm) -> None:
    idle_s = api_farm.settings.session_idle_s
    for _ in range(2):
        api_farm.now_s += idle_s - 1
        assert browser.get(SESSION).status_code == 200
        _flush(browser)
    api_farm.now_s += idle_s + 1
    assert browser.get(SESSION).status_code == 401


def test_an_idle_session_has_no_stream_and_is_deleted_and_idle_keys_are_not(browser: Client, api_farm: Farm) -> None:
    session_id = _cookie(browser).split(".")[0]
    idle_s = api_farm.settings.session_idle_s
    with api_farm.writing() as session:
        ids = set(session.scalars(select(Credential.id)))
        used = {"idle_s": idle_s, "now_s": api_farm.now_s + idle_s}
        assert access_rows.valid(session, ids, **used) == ids
        used["now_s"] += 1
        assert access_rows.valid(session, ids, **used) == ids - {session_id}
        access_rows.delete_expired(session, **used, idempotency_s=1, audit_s=1)
        assert set(session.scalars(select(Credential.id))) == ids - {session_id}


@pytest.mark.promise("People", "A browser session ends after a time, however much it is used.")
def test_a_session_ends_after_its_time_however_much_it_is_used(browser: Client, api_farm: Farm) -> None:
    end_s = api_farm.now_s + api_farm.settings.session_s
    while api_farm.now_s + 3 * 86_400 < end_s:
        api_farm.now_s += 3 * 86_400
        assert browser.get(SESSION).status_code == 200
        _flush(browser)
    api_farm.now_s = end_s + 1
    assert browser.get(SESSION).status_code == 401


@pytest.mark.promise("People", "A revoked key ends its sessions.")
def test_a_revoked_key_ends_its_session_whichever_of_its_tokens_is_sent(api: Client, api_farm: Farm) -> None:
    made = api.post("/api/v1/keys", json={"name": "lab", "role": "viewer"}).json()
    admin = {"Authorization": str(api.headers.pop("Authorization"))}
    api.post("/login", data={"key": made["key"]}, follow_redirects=False)
    first = _cookie(api)
    api_farm.now_s += RENEW_S
    api.get(SESSION)
    api.get(SESSION)
    second = _cookie(api)
    assert [_status(api, cookie) for cookie in (first, second)] == [200, 200]
    api.cookies.clear()
    assert api.delete(f"/api/v1/keys/{made['id']}", headers=admin).status_code == 204
    assert [_status(api, cookie) for cookie in (first, second)] == [401, 401]


def test_an_admin_lists_and_ends_the_sessions_of_others(
    api: Client, api_farm: Farm, make_client: Callable[[Farm], Client]
) -> None:
    made = api.post("/api/v1/keys", json={"name": "lab", "role": "viewer"}).json()
    guest = make_client(api_farm)
    del guest.headers["Authorization"]
    guest.post("/login", data={"key": made["key"]}, follow_redirects=False)
    guest.get(SESSION)
    _flush(guest)
    answer = api.get("/api/v1/sessions")
    (listed,) = answer.json()["items"]
    assert (listed["name"], listed["role"], listed["owner_id"], listed["key_id"]) == (
        "lab", "viewer", made["id"], made["id"],
    )  # fmt: skip
    assert listed["used_at"] is not None
    secret = _cookie(guest).split(".")[1]
    assert secret not in answer.text
    assert api.delete(f"/api/v1/sessions/{made['id']}").status_code == 404  # a key is no session
    assert api.delete(f"/api/v1/sessions/{listed['id']}").status_code == 204
    assert guest.get(SESSION).status_code == 401
    assert api.delete(f"/api/v1/sessions/{listed['id']}").status_code == 404
    assert api.get("/api/v1/sessions").json()["items"] == []
    with api_farm.database.reading() as session:
        kinds = session.scalars(select(Credential.kind)).all()
        assert CredentialKind.SESSION not in kinds
