"""Ask the API for everything that its description allows: `python -m tests.security.contract --examples 500`.

schemathesis makes requests that the description allows and requests that it does not, and compares each answer with it.
Most of the requests name what the farm has instead of random ids. An admin sends them, and a few come from the other
roles and from nobody.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import requests
import schemathesis
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import seed as with_seed
from hypothesis.errors import Unsatisfiable
from schemathesis import GenerationMode
from schemathesis.checks import not_a_server_error
from schemathesis.core.failures import Failure, FailureGroup
from schemathesis.specs.openapi.checks import (
    content_type_conformance,
    negative_data_rejection,
    response_headers_conformance,
    response_schema_conformance,
    status_code_conformance,
)

from lippmann.job.states import JobStatus
from service.dependencies import SAFE_METHODS
from service.openapi import FILE
from service.schemas.access import Role
from tests.security.contract_farm import JOB, NOBODY, WORKER, ContractFarm, contract_farm

CHECKS = [
    not_a_server_error,
    status_code_conformance,
    content_type_conformance,
    response_headers_conformance,
    response_schema_conformance,
]
JOBS = [JobStatus.RUNNING, JobStatus.PAUSED, JobStatus.FAILED]
"""The jobs of requests that change one."""
CHEAP = {"rays": 4, "size": 100}
"""The numbers that pictures for an observer have instead of random ones; a large picture takes seconds."""
URL = "http://testserver"


@dataclass
class Report:
    """The results of one operation."""

    operation: str
    statuses: dict[int, int] = field(default_factory=dict)
    """The number of answers with each status."""
    findings: dict[str, str] = field(default_factory=dict)
    """The requests and answers that went wrong, by the title of the finding."""

    def __str__(self) -> str:
        counts = ", ".join(f"{status}: {count}" for status, count in sorted(self.statuses.items()))
        return f"{self.operation:<55} {counts}"


@dataclass(frozen=True)
class _Round:
    """Requests of one kind."""

    caller: str
    is_real: bool
    """Whether they name what the farm has."""
    mode: GenerationMode


def check_operations(farm: ContractFarm, *, examples: int, seed: int, only: str = "") -> Iterator[Report]:
    """Ask each operation about three times as often as there are examples.

    Parameters
    ----------
    only
        A part of the method and the path of the operations.
    """
    schema = schemathesis.openapi.from_dict(json.loads(FILE.read_text("utf-8")))
    for result in schema.get_all_operations():
        operation = result.ok()  # type: ignore[union-attr] # the description is valid
        if only not in operation.label:
            continue
        report = Report(operation.label)
        for mode, caller, is_real, count in _rounds(examples):
            cases = operation.as_strategy(generation_mode=mode)
            with suppress(Unsatisfiable):  # Without parameters there is no request that is not allowed.
                _ask(farm, cases, report, _Round(caller, is_real, mode), examples=count, seed=seed)
        yield report


def _rounds(examples: int) -> Iterator[tuple[GenerationMode, str, bool, int]]:
    """Yield kind and sender of requests, whether they name what the farm has, and their number."""
    yield GenerationMode.POSITIVE, Role.ADMIN, True, examples
    yield GenerationMode.POSITIVE, Role.ADMIN, False, max(1, examples // 3)
    yield GenerationMode.NEGATIVE, Role.ADMIN, True, examples
    for caller in (Role.SUBMITTER, Role.VIEWER, NOBODY):
        yield GenerationMode.POSITIVE, caller, True, max(1, examples // 3)


def _ask(farm: ContractFarm, cases: Any, report: Report, one: _Round, *, examples: int, seed: int) -> None:
    @with_seed(seed)
    @settings(
        max_examples=examples, database=None, deadline=None, phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
    )  # fmt: skip
    @given(case=cases)
    def ask(case: Any) -> None:
        status, is_random = JOBS[sum(report.statuses.values()) % len(JOBS)], True
        if one.is_real:
            is_random = not _name_what_there_is(farm, case, status, is_allowed=one.mode.is_positive)
        is_random = is_random and not _is_written_alike(case)
        answer = _send(farm, case, one)
        report.statuses[answer.status_code] = report.statuses.get(answer.status_code, 0) + 1
        try:
            # A request may have become one that is allowed.
            case.validate_response(answer, checks=[*CHECKS, negative_data_rejection] if is_random else CHECKS)
        except FailureGroup as failures:
            for failure in failures.exceptions:
                report.findings.setdefault(_title(failure, answer), f"{case!r} as {one.caller}: {answer.text[:500]}")

    ask()


def _is_written_alike(case: Any) -> bool:
    """Return whether a query has a list of one for a value, or a value for a list: the address is the same."""
    lists = {one["name"] for one in case.operation.definition.raw.get("parameters", ()) if _is_list(one["schema"])}
    return any((isinstance(value, list) and len(value) == 1) != (name in lists) for name, value in case.query.items())


def _is_list(schema: dict[str, Any]) -> bool:
    return "array" in {schema.get("type"), *(one.get("type") for one in schema.get("anyOf", ()))}


def _title(failure: Failure, answer: Any) -> str:
    return f"{failure.title} ({answer.status_code}): {failure.message.splitlines()[0] if failure.message else ''}"


def _name_what_there_is(farm: ContractFarm, case: Any, status: JobStatus, *, is_allowed: bool) -> bool:
    """Replace random ids by those of things that exist, and return whether there were any."""
    wanted, real = case.path_parameters, dict[str, object]()
    if "job_id" in wanted:
        is_safe, is_kept = case.method in SAFE_METHODS or case.path.endswith("/links"), case.method != "DELETE"
        real["job_id"] = farm.done_job if is_safe else farm.new_job(status, is_kept=is_kept)
    if "task_id" in wanted:
        real["task_id"] = farm.task
        if case.method == "POST":
            real |= farm.held_task()
    if "frame" in wanted:
        real["frame"] = 1
    if "key_id" in wanted:
        real["key_id"] = farm.new_key()
    if "session_id" in wanted:
        real["session_id"] = farm.new_session()
    if "worker" in wanted:
        real["worker"] = farm.marked_worker() if case.method == "DELETE" else WORKER.name
    if "name" in wanted:
        real["name"] = _name(farm, case)
    case.path_parameters = wanted | real
    case.query = {name: CHEAP[name] if isinstance(value, int) and name in CHEAP else value
                  for name, value in case.query.items()}  # fmt: skip
    if is_allowed and isinstance(case.body, dict) and "scene" in case.body:
        case.body, case.query = JOB, {}
        return True
    if is_allowed and case.path.endswith("/skip"):
        case.body = {"frames": [1]}
    if is_allowed and case.method == "PATCH":
        case.body = {"priority": 60}
    if is_allowed and case.path.endswith("/links"):
        case.body = {"artifact": farm.artifacts[0]}
    if is_allowed and case.path.startswith("/api/v1/links/"):
        case.query = {"token": farm.link_token(str(real["name"]))}
    return bool(real)


def _name(farm: ContractFarm, case: Any) -> str:
    """Return the name of what a request asks for: an output, a file of a job, or a scene."""
    if case.path.endswith("/outputs/{name}.zip"):
        return str(JOB["outputs"][0])
    if "job_id" in case.path_parameters:
        return farm.artifacts[len(str(case.path_parameters["name"])) % len(farm.artifacts)]
    return farm.new_scene() if case.method == "DELETE" else "fish"


def _send(farm: ContractFarm, case: Any, one: _Round) -> Any:
    parts = case.as_transport_kwargs(base_url=URL)
    if one.is_real and one.mode.is_positive and case.media_type == "multipart/form-data":
        parts |= {"params": {"name": "spare"}, "data": None, "files": {"bundle": ("spare.zip", farm.bundle)}}
    request = requests.Request(**parts).prepare()
    headers = {name.lower(): value for name, value in request.headers.items()}
    headers.pop("cookie", None)
    headers.pop("authorization", None)
    if one.caller != NOBODY:
        headers["authorization"] = f"Bearer {farm.keys[one.caller]}"
    sent = [(_bytes(name), _bytes(value)) for name, value in headers.items()]
    return farm.client.request(str(request.method), str(request.url), headers=sent, content=request.body)


def _bytes(text: str | bytes) -> bytes:
    return text if isinstance(text, bytes) else text.encode("latin-1")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; the exit code is 1 if there are findings."""
    parser = argparse.ArgumentParser(prog="python -m tests.security.contract", description=__doc__)
    parser.add_argument("--examples", type=int, default=100, help="the number of requests of each kind and operation")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", default="", help="a part of the method and the path, such as 'POST /api/v1/jobs'")
    options = parser.parse_args(arguments)
    found = 0
    with tempfile.TemporaryDirectory(prefix="lippmann-contract-") as folder, contract_farm(Path(folder)) as farm:
        for report in check_operations(farm, examples=options.examples, seed=options.seed, only=options.only):
            print(report, flush=True)
            for title, what in report.findings.items():
                print(f"  {title}\n    {what}", flush=True)
            found += len(report.findings)
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
