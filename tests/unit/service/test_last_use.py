"""The last use of keys."""

from __future__ import annotations

import pytest
from sqlalchemy.exc import OperationalError

from service.auth import create_key
from service.db import access as access_rows
from service.db.engine import Database
from service.last_use import LastUse
from service.schemas.access import Role
from tests.builders_service import T0, Client, Farm


def test_the_list_of_keys_says_when_each_was_used_last_also_by_a_browser(api: Client, api_farm: Farm) -> None:
    made = api.post("/api/v1/keys", json={"name": "lab", "role": "viewer"}).json()

    def used_at() -> str | None:
        items: list[dict[str, str | None]] = api.get("/api/v1/keys").json()["items"]
        return next(item["used_at"] for item in items if item["id"] == made["id"])

    assert used_at() is None
    api.get("/api/v1/jobs", headers={"Authorization": f"Bearer {made['key']}"})
    first = used_at()
    assert first is not None
    admin = api.headers.pop("Authorization")
    api.post("/login", data={"key": made["key"]})
    api_farm.now_s += 3600
    api.get("/api/v1/session")
    api.headers["Authorization"] = admin
    assert (used_at() or "") > first


def test_times_that_cannot_be_written_are_kept_and_a_revoked_key_is_left_out(
    farm: Farm, monkeypatch: pytest.MonkeyPatch
) -> None:
    with farm.writing() as session:
        key_id, _ = create_key(session, "lab", Role.VIEWER)
    last_use = LastUse(farm.database)
    last_use.note(key_id, "gone", now_s=T0)

    def fail(_database: Database) -> None:
        raise OperationalError("UPDATE", {}, Exception("the disk is full"))

    with monkeypatch.context() as broken:
        broken.setattr(Database, "writing", fail)
        last_use.write()
    last_use.write()
    with farm.database.reading() as session:
        row = access_rows.credential(session, key_id)
        assert row is not None
        assert row.used_s == T0


def test_of_several_processes_the_one_that_knows_the_later_time_is_believed(farm: Farm) -> None:
    with farm.writing() as session:
        key_id, _ = create_key(session, "lab", Role.VIEWER)
    for used_s in (T0 + 20, T0):
        last_use = LastUse(farm.database)
        last_use.note(key_id, now_s=used_s)
        last_use.write()
    with farm.database.reading() as session:
        row = access_rows.credential(session, key_id)
        assert row is not None
        assert row.used_s == T0 + 20
