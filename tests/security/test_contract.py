"""The short form of the fuzz of the API; `make fuzz` runs the long one."""

from __future__ import annotations

from pathlib import Path
from typing import Any, cast

import httpx
import pytest

from service.schemas.access import Role
from tests.security.contract import check_operations
from tests.security.contract_farm import NOBODY, ContractFarm, contract_farm

SEED = 20261129
EXAMPLES = 3
JSON = {"Content-Type": "application/json"}


@pytest.mark.promise("People", "The API answers every request as its description says.")
def test_every_answer_is_one_that_the_description_has(tmp_path: Path) -> None:
    with contract_farm(tmp_path) as farm:
        reports = list(check_operations(farm, examples=EXAMPLES, seed=SEED))
    assert {report.operation: report.findings for report in reports if report.findings} == {}
    assert [report.operation for report in reports if not any(status < 300 for status in report.statuses)] == []


@pytest.mark.parametrize(
    ("status", "headers", "text"),
    [
        (200, {"Content-Type": "text/html"}, "a page"),
        (200, JSON, "{}"),
        (418, JSON, "{}"),
        (500, {"Content-Type": "application/problem+json"}, "{}"),
    ],
)
def test_an_answer_that_the_description_does_not_have_is_found(status: int, headers: dict[str, str], text: str) -> None:
    wrong = httpx.MockTransport(lambda _: httpx.Response(status, headers=headers, content=iter([text.encode()])))
    keys = dict.fromkeys([*Role, NOBODY], "key")
    with httpx.Client(transport=wrong) as client:
        farm = ContractFarm(cast(Any, None), cast(Any, client), keys, "", "", "", [], b"")
        (report,) = check_operations(farm, examples=1, seed=SEED, only="GET /api/v1/workers")
    assert report.findings
