"""The contract that is committed is the contract that is served."""

from __future__ import annotations

import json

from service.openapi import FILE, contract
from tests.builders_service import Client


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
