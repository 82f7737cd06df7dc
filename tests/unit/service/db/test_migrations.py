"""A job that was taken before outputs had options: it shows, is retried and finishes; nothing is migrated.

And migrations only add to the schema of the version before, whose processes go on during an upgrade.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from alembic import command
from sqlalchemy import Connection, inspect, update

from lippmann.job.messages.orders import TaskKind
from lippmann.job.outputs.choice import DEFAULT_OUTPUTS, output_called
from lippmann.job.resolved import ResolvedJob, StoredPlan
from lippmann.job.states import JobStatus
from lippmann.plan import artifact_names as names
from service.db.engine import Database
from service.db.migrations import alembic_config
from service.db.tables import Job
from tests.builders_service import Client, Farm, claimed, done, failed

NAMES = ["views.mp4", "centre.mp4", "orthoscopic.mkv"]
CHANGED = {"capture": {"method": "auto", "supersample": 1}, "outputs": NAMES}
"""What was otherwise in the JSON of a spec: no depth, and outputs as the names of three files."""


def _without(data: dict[str, Any] | None, field: str) -> dict[str, Any] | None:
    return data and {name: value for name, value in data.items() if name != field}


def _store_as_before(farm: Farm, job_id: str) -> None:
    """Take from a job what nothing was stored of before: sheets from elsewhere, and whether anything is rendered."""
    row, files = farm.job(job_id), farm.store.files
    for name, field in ((names.JOB_FILE, "sheets"), (names.PLAN_FILE, "renders")):
        if f"{job_id}/{name}" in files:
            said = json.loads(files[f"{job_id}/{name}"])
            assert said.pop(field, "not there") != "not there"
            said |= {"spec": said["spec"] | CHANGED} if "spec" in said else {}
            files[f"{job_id}/{name}"] = json.dumps(said).encode()
    stored = {"probe": _without(row.probe, "renders"), "plan": _without(row.plan, "renders")}
    with farm.writing() as session:
        session.execute(update(Job).where(Job.id == job_id).values(spec=row.spec | CHANGED, **stored))


def test_a_job_of_before_is_shown_retried_and_finished(api: Client, api_farm: Farm) -> None:
    job_id = api_farm.planned(outputs=NAMES)
    _store_as_before(api_farm, job_id)
    while (orders := api_farm.dispatch()) and orders[0].kind is not TaskKind.ENCODE:
        api_farm.say(*(said for order in orders for said in (claimed(order), done(order))))
    bad, *others = orders
    api_farm.say(claimed(bad), failed(bad, code="output", permanent=True))
    for order in (*others, *api_farm.dispatch()):
        api_farm.say(claimed(order), done(order))
    sheet = StoredPlan.model_validate_json(api_farm.store.files[f"{job_id}/{names.PLAN_FILE}"])
    assert (sheet.tile_rows, sheet.renders) == (2, True)
    (shown,) = api.get("/api/v1/jobs").json()["items"]
    assert (shown["status"], [output["ready"] for output in shown["outputs"]]) == ("failed", [False, True, True])
    assert [output["name"] for output in shown["outputs"]] == NAMES
    assert shown["outputs"][0]["url"] == f"/api/v1/jobs/{job_id}/artifacts/video/views.mp4"
    assert api.post(f"/api/v1/jobs/{job_id}/retry").status_code == 200
    api_farm.work()
    assert api_farm.job(job_id).status is JobStatus.DONE
    assert [output["ready"] for output in api.get(f"/api/v1/jobs/{job_id}").json()["outputs"]] == [True, True, True]


def test_a_job_of_before_that_is_not_planned_yet_asks_workers_for_the_same_files(api_farm: Farm) -> None:
    job_id = api_farm.submit(outputs=NAMES)
    _store_as_before(api_farm, job_id)
    (probe,) = api_farm.dispatch()
    api_farm.say(claimed(probe), done(probe))
    api_farm.plan()
    encodes = [task for task in api_farm.tasks(job_id) if task.kind is TaskKind.ENCODE]
    assert [(task.output, task.artifact) for task in encodes] == [(name, f"video/{name}") for name in NAMES]
    sheet = ResolvedJob.model_validate_json(api_farm.store.files[f"{job_id}/{names.JOB_FILE}"])
    assert tuple(output_called(sheet.spec.outputs, name) for name in NAMES) == DEFAULT_OUTPUTS


ROLLING = "0009"
"""The revision of the oldest version that may be upgraded while it works."""


def _columns(connection: Connection) -> dict[tuple[str, str], tuple[str, bool, bool]]:
    """Return the type of each column, whether it may be null, and whether it has a default."""
    found = inspect(connection)
    return {
        (table, column["name"]): (str(column["type"]), bool(column["nullable"]), column["default"] is not None)
        for table in found.get_table_names()
        if table != "alembic_version"
        for column in found.get_columns(table)
    }


def test_a_process_of_the_version_before_can_work_with_the_schema_of_this_one(tmp_path: Path) -> None:
    database = Database(f"sqlite:///{tmp_path}/farm.db")
    with database.connecting() as connection:
        command.upgrade(alembic_config(connection), ROLLING)
        before = _columns(connection)
        command.upgrade(alembic_config(connection), "head")
        after = _columns(connection)
    database.dispose()
    assert before.keys() <= after.keys(), "the version before reads and writes these columns"
    assert {name: after[name][:2] for name in before} == {name: kind[:2] for name, kind in before.items()}
    tables = {table for table, _ in before}
    added = {name: kind for name, kind in after.items() if name not in before and name[0] in tables}
    assert [name for name, (_, nullable, has_default) in added.items() if not (nullable or has_default)] == []
