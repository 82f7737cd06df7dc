"""The audit log."""

from __future__ import annotations

import pytest
from fastapi.routing import iter_route_contexts
from sqlalchemy import text

from service.auth import create_key
from service.db import access as access_rows
from service.main import create_app
from service.schemas.access import AuditAction, Role
from tests.builders_service import SPEC, T0, Client, Farm


def test_the_log_says_who_changed_what_when_and_from_where_newest_first(api: Client, api_farm: Farm) -> None:
    with api_farm.writing() as session:
        key_id, key = create_key(session, "ann", Role.SUBMITTER, owner_id="ann")
    headers = {"Authorization": f"Bearer {key}", "X-Request-Id": "from-ann"}
    job_id = api.post("/api/v1/jobs", json=SPEC, headers=headers).json()["id"]
    api_farm.now_s += 5
    api.patch(f"/api/v1/jobs/{job_id}", json={"priority": 80}, headers=headers)
    api.post(f"/api/v1/jobs/{job_id}/resume", headers=headers)  # refused, because the job is not paused
    newest, before = api.get("/api/v1/audit").json()["items"]
    assert newest | {"id": 0} == {
        "id": 0, "at": "2030-03-17T17:46:45Z", "key_id": key_id, "name": "ann", "role": "submitter",
        "action": "prioritise-job", "subject": job_id, "detail": "priority 80", "address": "testclient",
        "request_id": "from-ann",
    }  # fmt: skip
    assert (before["action"], before["subject"], before["detail"]) == ("submit-job", job_id, "scene ball")


def test_the_log_is_read_in_pages(api: Client) -> None:
    for _ in range(3):
        api.post("/api/v1/jobs", json=SPEC)
    first = api.get("/api/v1/audit", params={"limit": 2}).json()
    rest = api.get("/api/v1/audit", params={"limit": 2, "cursor": first["next_cursor"]}).json()
    ids = [item["id"] for page in (first, rest) for item in page["items"]]
    assert (len(ids), sorted(ids, reverse=True), rest["next_cursor"]) == (3, ids, None)


def test_the_log_is_filtered_by_action_key_and_subject(api: Client) -> None:
    first, second = (api.post("/api/v1/jobs", json=SPEC).json()["id"] for _ in range(2))
    api.post(f"/api/v1/jobs/{first}/cancel")

    def found(**asked: str) -> list[tuple[str, str]]:
        items = api.get("/api/v1/audit", params=asked).json()["items"]
        return [(item["action"], item["subject"]) for item in items]

    assert found(action="cancel-job") == [("cancel-job", first)]
    assert found(subject=first) == [("cancel-job", first), ("submit-job", first)]
    assert found(name="tester", action="submit-job") == [("submit-job", second), ("submit-job", first)]
    assert found(name="nobody") == []
    assert api.get("/api/v1/audit", params={"action": "sing"}).status_code == 422


def test_a_repeated_submission_changes_nothing_and_is_not_in_the_log(api: Client) -> None:
    for _ in range(2):
        api.post("/api/v1/jobs", json=SPEC, headers={"Idempotency-Key": "one"})
    assert len(api.get("/api/v1/audit").json()["items"]) == 1


def test_old_entries_and_expired_sessions_are_deleted_and_expired_keys_stay(api: Client, api_farm: Farm) -> None:
    with api_farm.writing() as session:
        key_id, _ = create_key(session, "old", Role.VIEWER, expires_s=T0 - 1)
    api.post("/api/v1/jobs", json=SPEC)
    api_farm.now_s += 11
    api.post("/api/v1/login-tokens")
    with api_farm.writing() as session:
        access_rows.delete_expired(session, now_s=api_farm.now_s, idle_s=1, idempotency_s=1, audit_s=10)
    items = api.get("/api/v1/audit").json()["items"]
    assert [item["action"] for item in items] == [AuditAction.CREATE_LOGIN_LINK]
    assert key_id in [key["id"] for key in api.get("/api/v1/keys").json()["items"]]


@pytest.mark.promise("People", "No change is made without its entry in the audit log, and no route changes an entry.")
def test_a_change_without_its_entry_is_not_made_and_no_route_changes_an_entry(api: Client, api_farm: Farm) -> None:
    routes = list(iter_route_contexts(create_app(api_farm.settings, api_farm.parts).routes))
    assert {method for route in routes if "audit" in (route.path or "") for method in route.methods or ()} == {"GET"}
    with api_farm.writing() as session:
        begin = "CREATE TRIGGER no_entry BEFORE INSERT ON audit BEGIN"
        session.execute(text(f"{begin} SELECT RAISE(ABORT, 'no entry'); END"))
    assert api.post("/api/v1/keys", json={"name": "unseen"}).status_code >= 500
    assert "unseen" not in [key["name"] for key in api.get("/api/v1/keys").json()["items"]]
    with api_farm.writing() as session:
        session.execute(text("DROP TRIGGER no_entry"))
    assert api.post("/api/v1/keys", json={"name": "seen"}).status_code == 201
    assert "seen" in [key["name"] for key in api.get("/api/v1/keys").json()["items"]]
