"""The contract that is committed is the contract that is served."""

from __future__ import annotations

import json
import re

import pytest
from pydantic import ValidationError

from service.db.tables import JobEvent
from service.openapi import FILE, contract
from service.schemas.events import EventTopic, JobRemoved, StreamMessage
from tests.builders_service import Client, Farm


def test_the_committed_contract_is_up_to_date() -> None:
    assert FILE.read_text(encoding="utf-8") == contract(), "run: python -m service.openapi"


def test_the_committed_contract_is_openapi_3_1_and_describes_the_job_file() -> None:
    described = json.loads(FILE.read_text(encoding="utf-8"))
    assert described["openapi"].startswith("3.1")
    body = described["paths"]["/api/v1/jobs"]["post"]["requestBody"]["content"]["application/json"]["schema"]
    assert body["$ref"].rpartition("/")[2] in described["components"]["schemas"]


def test_what_is_served_is_what_is_committed_but_for_the_version(api: Client) -> None:
    served = api.get("/api/v1/openapi.json").json()
    committed = json.loads(FILE.read_text(encoding="utf-8"))
    served["info"].pop("version")
    committed["info"].pop("version")
    assert served == committed


def test_every_reference_of_the_contract_leads_to_something() -> None:
    text = FILE.read_text(encoding="utf-8")
    described = json.loads(text)
    for kind, name in set(re.findall(r'"#/components/(\w+)/(\w+)"', text)):
        assert name in described["components"][kind], name


def test_the_contract_describes_every_event_of_the_stream() -> None:
    described = json.loads(FILE.read_text(encoding="utf-8"))
    schemas = described["components"]["schemas"]
    content = described["paths"]["/api/v1/events"]["get"]["responses"]["200"]["content"]
    assert set(content) == {"text/event-stream"}
    message = schemas[content["text/event-stream"]["schema"]["$ref"].rpartition("/")[2]]
    assert set(message["discriminator"]["mapping"]) == set(EventTopic)
    assert {"JobProgress", "JobRemoved", "TaskChange", "FrameChange"} <= set(schemas)


def test_every_stored_event_of_a_job_follows_its_schema(api: Client, api_farm: Farm) -> None:
    job_id = api_farm.planned()
    api_farm.work()
    assert api.delete(f"/api/v1/jobs/{job_id}").status_code == 204
    with api_farm.database.reading() as session:
        rows = session.query(JobEvent).filter(JobEvent.job_id == job_id).all()
    messages = [StreamMessage.model_validate({"event": row.topic, "data": row.data}).root for row in rows]
    assert {message.event for message in messages} == set(EventTopic) - {EventTopic.RESET}
    assert isinstance(messages[-1].data, JobRemoved)


def test_an_incomplete_job_is_refused_and_not_taken_for_a_removal() -> None:
    with pytest.raises(ValidationError):
        StreamMessage.model_validate({"event": "job", "data": {"id": "j1", "status": "done"}}, extra="ignore")
