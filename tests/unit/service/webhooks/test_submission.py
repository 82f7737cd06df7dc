"""A job names a webhook when it is submitted."""

from __future__ import annotations

import pytest
from sqlalchemy import select

from service.db.tables import AuditRow
from tests.builders_service import SPEC, Client, Farm

URL = "https://hooks.example.org/T0/secret"
JOBS = "/api/v1/jobs"


def test_a_url_is_stored_and_only_its_host_is_shown(api: Client, api_farm: Farm) -> None:
    made = api.post(JOBS, params={"webhook": URL}, json=SPEC)
    assert made.status_code == 201
    assert made.json()["webhook"] == {"host": "hooks.example.org", "error": None}
    assert "secret" not in made.text
    assert api_farm.job(made.json()["id"]).webhook_url == URL
    assert api.post(JOBS, json=SPEC).json()["webhook"] is None
    with api_farm.database.reading() as session:
        details = session.scalars(select(AuditRow.detail).order_by(AuditRow.id)).all()
    assert details[-2:] == ["scene ball, webhook hooks.example.org", "scene ball"]


@pytest.mark.parametrize("url", ["http://hooks.example.org/", "https://169.254.169.254/latest", "https://[::1]/", "x"])
def test_a_url_that_the_farm_may_not_send_to_is_refused_with_the_field(api: Client, url: str) -> None:
    refused = api.post(JOBS, params={"webhook": url}, json=SPEC)
    assert (refused.status_code, refused.json()["errors"][0]["field"]) == (422, "webhook")


def test_an_idempotency_key_is_for_one_webhook(api: Client) -> None:
    headers = {"Idempotency-Key": "once"}
    first = api.post(JOBS, params={"webhook": URL}, json=SPEC, headers=headers)
    again = api.post(JOBS, params={"webhook": URL}, json=SPEC, headers=headers)
    assert (again.status_code, again.json()["id"]) == (200, first.json()["id"])
    other = api.post(JOBS, params={"webhook": URL + "2"}, json=SPEC, headers=headers)
    assert (other.status_code, other.json()["code"]) == (422, "idempotency-mismatch")


def test_each_owner_has_a_secret(api: Client) -> None:
    keys = [api.post("/api/v1/keys", json={"name": "k", "owner_id": owner}).json()["key"] for owner in ("ann", "bob")]
    answers = [api.get("/api/v1/webhook-secret", headers={"Authorization": f"Bearer {key}"}).json() for key in keys]
    assert [answer["owner_id"] for answer in answers] == ["ann", "bob"]
    assert all(answer["secret"].startswith("whsec_") for answer in answers)
    assert answers[0]["secret"] != answers[1]["secret"]
