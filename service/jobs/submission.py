"""A job file becomes a job: checked, stored for workers, then remembered."""

from __future__ import annotations

import hashlib
import json
from typing import Any

from sqlalchemy.orm import Session

from lippmann.errors import FieldProblem, SpecError
from lippmann.job.old_names import current_job
from lippmann.job.resolved import JobSheet
from lippmann.job.scene import SceneCard
from lippmann.job.spec import JobSpec, parse_spec
from lippmann.job.states import JobStatus
from lippmann.optics.rig.check import check_job
from lippmann.plan import artifact_names as names
from lippmann.plan.tasks import probe_task
from service.api import presenters as show
from service.auth import Caller
from service.db import access as access_rows
from service.db import jobs as job_rows
from service.db.engine import Database
from service.db.tables import IdempotencyKey, Job
from service.errors import IdempotencyMismatch, NotFound
from service.events.publish import tell_job
from service.ids import new_job_id
from service.jobs.planner import insert_tasks
from service.ports import Parts
from service.scenes import find_scene
from service.schemas import job as schema


def submit_job(
    database: Database, parts: Parts, caller: Caller, body: Any, *, idempotency_key: str | None, now_s: float
) -> tuple[schema.Job, bool]:
    """Make a job of a job file, and return it and whether it is new.

    Raises
    ------
    SpecError
        Naming every field that cannot be.
    IdempotencyMismatch
        If the key was used for another job file.
    StoreFull, StoreUnavailable
        Nothing is remembered then.
    """
    spec = parse_spec(body)
    fingerprint = hashlib.sha256(json.dumps(body, sort_keys=True).encode()).hexdigest()
    with database.reading() as session:
        known = _known(session, caller, idempotency_key, fingerprint)
        if known is not None:
            return show.show_job(session, known), False
        sheet = resolved(session, spec, new_job_id(now_s))
    notes = (*current_job(body)[1], *check_job(sheet))
    # The artifact first, the row last: a crash in between leaves a file nobody asks for, never a job without one.
    data = sheet.model_dump_json(indent=2).encode()
    parts.store.put_bytes(names.job_artifact(sheet.job_id, names.JOB_SHEET), data)
    with database.writing() as session:
        known = _known(session, caller, idempotency_key, fingerprint)
        if known is not None:
            return show.show_job(session, known), False
        row = _remember(session, sheet, caller, list(notes), now_s)
        if idempotency_key is not None:
            session.merge(
                IdempotencyKey(
                    caller=caller.key_id,
                    key=idempotency_key,
                    fingerprint=fingerprint,
                    job_id=row.id,
                    created_s=now_s,
                )
            )
        return show.show_job(session, row), True


def _known(session: Session, caller: Caller, key: str | None, fingerprint: str) -> Job | None:
    used = access_rows.idempotency(session, caller.key_id, key) if key is not None else None
    row = job_rows.job(session, used.job_id) if used is not None else None
    if used is not None and row is not None and used.fingerprint != fingerprint:
        raise IdempotencyMismatch(f"Idempotency-Key {key!r} was used for job {row.id}, which asked for something else")
    return row


def resolved(session: Session, spec: JobSpec, job_id: str) -> JobSheet:
    """Return a job with its scene looked up.

    Raises
    ------
    SpecError
        If there is no such scene, or it does not take what the job says.
    """
    try:
        scene = find_scene(session, spec.scene)
    except NotFound as error:
        problem = FieldProblem(field="scene", expected="a scene of GET /api/v1/scenes", got=repr(spec.scene))
        raise SpecError.of([problem]) from error
    return JobSheet.of(job_id, spec, SceneCard.model_validate(scene.card), bundle=scene.digest)


def _remember(session: Session, sheet: JobSheet, caller: Caller, notes: list[str], now_s: float) -> Job:
    spec = sheet.spec
    row = Job(
        id=sheet.job_id,
        title=spec.title or spec.scene,
        scene=spec.scene,
        spec=spec.model_dump(mode="json"),
        notes=notes,
        owner=caller.name,
        status=JobStatus.QUEUED,
        priority=spec.priority,
        created_s=now_s,
        frames_total=len(spec.frame_numbers),
    )
    session.add(row)
    session.flush()
    insert_tasks(session, row.id, [probe_task()])
    session.refresh(row)
    tell_job(session, row)
    return row
