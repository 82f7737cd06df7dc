"""Keys, roles, login links and browser sessions."""

from __future__ import annotations

import json
from typing import Any

import pytest

from service.auth import create_key, create_login_token
from service.db import coordinator as coordinator_rows
from service.db.tables import Credential
from service.oidc.account import MAX_SUBJECT, OWNER_PREFIX
from service.openapi import FILE
from service.schemas.access import Role
from tests.builders_service import SPEC, T0, Client, Farm

JOBS = "/api/v1/jobs"
VIEWS = ["/jobs", "/scenes", "/workers", "/jobs/x", "/jobs/x/tasks", "/jobs/x/frames", "/jobs/x/artifacts",
         "/jobs/x/artifacts/y", "/jobs/x/events", "/events", "/session", "/scenes/ball/poster.png"]  # fmt: skip
CHANGES = [("POST", "/jobs"), ("POST", "/jobs/x/cancel"), ("POST", "/jobs/x/retry"), ("DELETE", "/jobs/x"),
           ("PATCH", "/jobs/x"), ("POST", "/scenes?name=x")]  # fmt: skip
ADMINS = [("GET", "/keys"), ("POST", "/keys"), ("DELETE", "/keys/x"), ("POST", "/login-tokens")]


@pytest.fixture
def anyone(api: Client) -> Client:
    """Lend the client without its key."""
    del api.headers["Authorization"]
    return api


def _key(farm: Farm, role: Role) -> dict[str, str]:
    with farm.writing() as session:
        return {"Authorization": f"Bearer {create_key(session, role.value, role)[1]}"}


@pytest.mark.parametrize(("method", "path"), [("GET", path) for path in VIEWS] + CHANGES + ADMINS)
def test_nothing_is_answered_without_a_key(anyone: Client, method: str, path: str) -> None:
    answer = anyone.request(method, f"/api/v1{path}")
    assert (answer.status_code, answer.json()["code"]) == (401, "unauthorized")
    assert answer.headers["WWW-Authenticate"] == "Bearer"


@pytest.mark.promise("People", "Only health, the login and signed links answer without a key.")
def test_every_route_but_health_and_login_asks_for_a_key(anyone: Client) -> None:
    paths = json.loads(FILE.read_text(encoding="utf-8"))["paths"]
    assert len(paths) > 15
    open_to_all = set()
    for path, operations in paths.items():
        for method in operations:
            if anyone.request(method, path.replace("{", "").replace("}", "")).status_code != 401:
                open_to_all.add((method, path))
    assert open_to_all == {("get", "/api/v1/health")}


@pytest.mark.parametrize(("method", "path"), CHANGES + ADMINS)
def test_a_viewer_changes_nothing(anyone: Client, api_farm: Farm, method: str, path: str) -> None:
    answer = anyone.request(method, f"/api/v1{path}", headers=_key(api_farm, Role.VIEWER))
    assert (answer.status_code, answer.json()["code"]) == (403, "forbidden")


@pytest.mark.parametrize(("method", "path"), ADMINS)
def test_a_submitter_makes_no_keys(anyone: Client, api_farm: Farm, method: str, path: str) -> None:
    assert anyone.request(method, f"/api/v1{path}", headers=_key(api_farm, Role.SUBMITTER)).status_code == 403


def test_a_viewer_sees_and_a_submitter_submits(anyone: Client, api_farm: Farm) -> None:
    assert anyone.get(JOBS, headers=_key(api_farm, Role.VIEWER)).status_code == 200
    assert anyone.post(JOBS, json=SPEC, headers=_key(api_farm, Role.SUBMITTER)).status_code == 201


@pytest.mark.parametrize(
    "wrong",
    ["Bearer lip_0_0", "Bearer ", "Basic abc", "Bearer lip__", "nonsense", "Bearer lip_" + "x" * 500, "Bearer a.b"],
)
def test_a_wrong_key_is_refused(anyone: Client, wrong: str) -> None:
    assert anyone.get(JOBS, headers={"Authorization": wrong}).status_code == 401


def test_a_key_with_one_letter_changed_is_refused(anyone: Client, api_farm: Farm) -> None:
    right = _key(api_farm, Role.ADMIN)["Authorization"]
    wrong = right[:-1] + ("A" if right[-1] != "A" else "B")
    assert anyone.get(JOBS, headers={"Authorization": right}).status_code == 200
    assert anyone.get(JOBS, headers={"Authorization": wrong}).status_code == 401


@pytest.mark.parametrize("shown", [{}, {"Authorization": "Bearer lip_0_0"}, {"Authorization": ""}])
def test_health_without_a_key_names_healthy_components_and_nothing_of_the_inside(
    api: Client, api_farm: Farm, shown: dict[str, str]
) -> None:
    with api_farm.writing() as session:
        coordinator_rows.acquire_leadership(session, "machine-7-abc", now_s=T0, until_s=T0 + 10)
    health = "/api/v1/health"
    assert api.get(health).json()["coordinator"] == {"ok": True, "leader": "machine-7-abc"}
    del api.headers["Authorization"]
    answer = api.get(health, headers=shown)
    assert answer.status_code == 200
    assert answer.json() == {
        "status": "degraded",  # the broker is away
        "version": "",
        "database": {"ok": True, "detail": ""},
        "broker": {"ok": False, "detail": ""},
        "store": {"ok": True, "detail": "", "free_bytes": None},
        "coordinator": {"ok": True, "leader": None},
        "workers": None,
        "slots": None,
        "sandboxes": None,
        "faults": [],
        "notes": [],
        "dropped": None,
    }


def test_only_admins_learn_how_many_messages_were_refused(api: Client, api_farm: Farm) -> None:
    with api_farm.writing() as session:
        coordinator_rows.add_dropped(session, {"event": 2})
        coordinator_rows.add_dropped(session, {"event": 1, "presence": 5, "lease": 7})
    health = "/api/v1/health"
    assert api.get(health).json()["dropped"] == {
        "events": 3, "presences": 5, "leases": 7, "orders": None,
    }  # fmt: skip
    for role in (Role.VIEWER, Role.SUBMITTER):
        assert api.get(health, headers=_key(api_farm, role)).json()["dropped"] is None


def test_health_says_how_much_room_the_store_has_left_and_not_the_disk_of_the_data_folder(
    api: Client, api_farm: Farm
) -> None:
    assert api.get("/api/v1/health").json()["store"]["free_bytes"] == api_farm.store.free_bytes()


def test_keys_are_made_listed_without_secrets_and_revoked(api: Client) -> None:
    made = api.post("/api/v1/keys", json={"name": "lab", "role": "viewer"})
    assert made.status_code == 201
    key, key_id = made.json()["key"], made.json()["id"]
    assert key.startswith(f"lip_{key_id}_")
    listed = api.get("/api/v1/keys")
    assert key_id in [item["id"] for item in listed.json()["items"]]
    assert key.removeprefix(f"lip_{key_id}_") not in listed.text
    as_new = {"Authorization": f"Bearer {key}"}
    assert api.get(JOBS, headers=as_new).status_code == 200
    assert api.delete(f"/api/v1/keys/{key_id}").status_code == 204
    assert api.get(JOBS, headers=as_new).status_code == 401
    assert api.delete(f"/api/v1/keys/{key_id}").status_code == 404


@pytest.mark.promise("People", "Of a secret, only its digest is stored.")
def test_of_a_secret_only_its_digest_is_kept(api_farm: Farm) -> None:
    with api_farm.writing() as session:
        _, key = create_key(session, "n", Role.VIEWER)
        (row,) = session.query(Credential).all()
        secret = key.split("_", 2)[2]
        assert len(secret) >= 43  # 256 bits
        assert secret not in str(vars(row))


def _log_in(client: Client, farm: Farm, role: Role = Role.ADMIN) -> str:
    with farm.writing() as session:
        token = create_login_token(session, role=role, now_s=farm.now_s)
    answer = client.get("/login", params={"token": token}, follow_redirects=False)
    assert (answer.status_code, answer.headers["Location"]) == (303, "/")
    return token


def test_a_login_link_opens_a_session_with_a_cookie_that_scripts_cannot_read(anyone: Client, api_farm: Farm) -> None:
    with api_farm.writing() as session:
        token = create_login_token(session, now_s=api_farm.now_s)
    answer = anyone.get("/login", params={"token": token}, follow_redirects=False)
    cookie = answer.headers["Set-Cookie"].lower()
    assert "httponly" in cookie
    assert "samesite=strict" in cookie
    assert anyone.get("/api/v1/session").json() == {"name": "browser", "role": "admin", "owner_id": "admin"}


@pytest.mark.promise("People", "A login link works once.")
def test_a_login_link_works_once(anyone: Client, api_farm: Farm) -> None:
    token = _log_in(anyone, api_farm)
    anyone.cookies.clear()
    again = anyone.get("/login", params={"token": token}, follow_redirects=False)
    assert (again.status_code, again.json()["code"]) == (401, "unauthorized")
    assert anyone.get(JOBS).status_code == 401


def test_a_login_link_expires(anyone: Client, api_farm: Farm) -> None:
    with api_farm.writing() as session:
        token = create_login_token(session, now_s=T0)
    api_farm.now_s = T0 + 901
    assert anyone.get("/login", params={"token": token}, follow_redirects=False).status_code == 401


def test_a_login_token_is_no_session_and_a_session_is_no_key(anyone: Client, api_farm: Farm) -> None:
    with api_farm.writing() as session:
        token = create_login_token(session, now_s=api_farm.now_s)
    assert anyone.get(JOBS, headers={"Cookie": f"lippmann_session={token}"}).status_code == 401
    _log_in(anyone, api_farm)
    session_id, _, secret = anyone.cookies["lippmann_session"].partition(".")
    anyone.cookies.clear()
    assert anyone.get(JOBS, headers={"Authorization": f"Bearer lip_{session_id}_{secret}"}).status_code == 401


def test_a_session_expires(anyone: Client, api_farm: Farm) -> None:
    _log_in(anyone, api_farm)
    assert anyone.get(JOBS).status_code == 200
    api_farm.now_s += api_farm.settings.session_s + 1
    assert anyone.get(JOBS).status_code == 401


@pytest.mark.promise("People", "A browser changes something only for pages of the service.")
def test_a_browser_changes_things_only_for_our_own_pages(anyone: Client, api_farm: Farm) -> None:
    _log_in(anyone, api_farm)
    refused = anyone.post(JOBS, json=SPEC)
    assert (refused.status_code, refused.json()["code"]) == (403, "forbidden")
    assert anyone.post(JOBS, json=SPEC, headers={"X-Lippmann-Request": "1"}).status_code == 201


def test_a_key_opens_a_session_that_ends_with_the_key(api: Client, api_farm: Farm) -> None:
    made = api.post("/api/v1/keys", json={"name": "lab", "role": "viewer"}).json()
    admin = api.headers.pop("Authorization")
    answer = api.post("/login", data={"key": made["key"]}, follow_redirects=False)
    assert (answer.status_code, answer.headers["Location"]) == (303, "/")
    assert api.get("/api/v1/session").json() == {"name": "lab", "role": "viewer", "owner_id": made["id"]}
    api.delete(f"/api/v1/keys/{made['id']}", headers={"Authorization": admin})
    assert api.get("/api/v1/session").status_code == 401


def test_a_wrong_key_at_the_door_is_refused_in_the_callers_language(anyone: Client) -> None:
    page = anyone.post("/login", data={"key": "x"}, headers={"Accept": "text/html"}, follow_redirects=False)
    assert (page.status_code, page.headers["Location"]) == (303, "/?refused=1")
    assert anyone.post("/login", data={"key": "x"}, follow_redirects=False).status_code == 401


def test_logging_out_ends_the_session_for_good(anyone: Client, api_farm: Farm) -> None:
    _log_in(anyone, api_farm)
    cookie = anyone.cookies["lippmann_session"]
    anyone.post("/logout", headers={"X-Lippmann-Request": "1"}, follow_redirects=False)
    anyone.cookies.clear()
    assert anyone.get(JOBS, headers={"Cookie": f"lippmann_session={cookie}"}).status_code == 401


def test_a_login_link_made_over_the_api_carries_the_callers_role(api: Client) -> None:
    link = api.post("/api/v1/login-tokens")
    assert link.status_code == 201
    del api.headers["Authorization"]
    url = link.json()["url"]
    api.get(url[url.index("/login") :], follow_redirects=False)
    session = api.get("/api/v1/session").json()
    assert (session["name"], session["role"]) == ("tester", "admin")


def test_a_key_expires_with_the_sessions_that_it_opened(api: Client, api_farm: Farm) -> None:
    made = api.post("/api/v1/keys", json={"name": "guest", "role": "viewer", "expires_in_days": 2}).json()
    admin = api.headers.pop("Authorization")
    as_guest = {"Authorization": f"Bearer {made['key']}"}
    assert api.get(JOBS, headers=as_guest).status_code == 200
    api.post("/login", data={"key": made["key"]})
    assert api.get("/api/v1/session").status_code == 200
    api_farm.now_s += 2 * 86_400 + 1
    assert api.get(JOBS, headers=as_guest).status_code == 401
    assert api.get("/api/v1/session").status_code == 401
    listed = api.get("/api/v1/keys", headers={"Authorization": admin}).json()["items"]
    assert next(key for key in listed if key["id"] == made["id"])["expires_at"] == made["expires_at"]


@pytest.mark.parametrize(
    "wrong",
    [
        {"name": "a\nb"},
        {"name": "\u202egnp.exe"},
        {"name": "n" * 65},
        {"name": ""},
        {"name": "n", "expires_in_days": 0},
        {"name": "n", "owner_id": ""},
        {"name": "n", "role": "root"},
    ],
)
def test_a_key_with_a_wrong_field_is_refused(api: Client, wrong: dict[str, Any]) -> None:
    answer = api.post("/api/v1/keys", json=wrong)
    assert (answer.status_code, answer.json()["code"]) == (422, "invalid")


def test_a_key_may_belong_to_any_owner_that_logs_in_with_an_account(api: Client) -> None:
    owner_id = OWNER_PREFIX + "s" * MAX_SUBJECT
    answer = api.post("/api/v1/keys", json={"name": "n", "owner_id": owner_id})
    assert (answer.status_code, answer.json()["owner_id"]) == (201, owner_id)


def test_a_login_ends_the_session_that_the_browser_had_before(anyone: Client, api_farm: Farm) -> None:
    _log_in(anyone, api_farm)
    before = anyone.cookies["lippmann_session"]
    _log_in(anyone, api_farm)
    assert anyone.cookies["lippmann_session"] != before
    anyone.cookies.clear()
    assert anyone.get(JOBS, headers={"Cookie": f"lippmann_session={before}"}).status_code == 401


FOREIGN: list[dict[str, str]] = [
    {"Sec-Fetch-Site": "cross-site"},
    {"Sec-Fetch-Site": "same-site"},
    {"Origin": "https://evil.example"},
    {"Origin": "null"},
]
OWN: list[dict[str, str]] = [
    {},
    {"Sec-Fetch-Site": "same-origin", "Origin": "http://behind.a.proxy"},
    {"Origin": "http://testserver"},
    {"Origin": "http://127.0.0.1:8080"},
]


@pytest.mark.parametrize(("headers", "status"), [(one, 403) for one in FOREIGN] + [(one, 303) for one in OWN])
def test_only_our_own_page_logs_in_with_a_form(api: Client, headers: dict[str, str], status: int) -> None:
    key = api.headers.pop("Authorization").removeprefix("Bearer ")
    answer = api.post("/login", data={"key": key}, headers=headers, follow_redirects=False)
    assert answer.status_code == status
    assert ("lippmann_session" in api.cookies) == (status == 303)


def test_a_login_link_on_the_page_of_another_site_logs_in_only_after_a_question(anyone: Client, api_farm: Farm) -> None:
    with api_farm.writing() as session:
        token = create_login_token(session, now_s=api_farm.now_s)
    asked = anyone.get("/login", params={"token": token}, headers={"Sec-Fetch-Site": "cross-site"})
    assert asked.status_code == 200
    assert f'name="token" value="{token}"' in asked.text
    assert "lippmann_session" not in anyone.cookies
    anyone.post("/login", data={"token": token}, headers={"Sec-Fetch-Site": "same-origin"})
    assert anyone.get(JOBS).status_code == 200
