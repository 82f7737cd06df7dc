"""Submission: a job file is checked and stored as a job."""

from __future__ import annotations

import hashlib
import json
from typing import Any

from sqlalchemy.orm import Session

from lippmann.errors import FieldProblem, SpecError, StoreFull
from lippmann.job.fields.later_fields import later_defaults
from lippmann.job.fields.old_names import current_job
from lippmann.job.resolved import ResolvedJob
from lippmann.job.scenes.scene import SceneManifest
from lippmann.job.spec import JobSpec, parse_spec
from lippmann.job.states import JobStatus
from lippmann.optics.rig.check import check_job
from lippmann.plan import artifact_names as names
from lippmann.plan.tasks import probe_task
from service.audit import record
from service.auth import Caller
from service.db import access as access_rows
from service.db import jobs as job_rows
from service.db.engine import Database
from service.db.tables import IdempotencyKey, Job
from service.errors import IdempotencyMismatch, Invalid, NotFound
from service.events.publish import publish_jobs
from service.ids import new_job_id
from service.jobs.limits import check_quota, limited_spec
from service.jobs.planner import insert_tasks
from service.limits import Limits
from service.ports import Parts
from service.scenes import did_you_mean, find_scene
from service.schemas.access import AuditAction
from service.settings import Settings
from service.webhooks.receiver import ReceiverRefused, parse_receiver, rules_of

OWNER_NAME = 64
"""The length of the name that a job shows of its key; keys of earlier releases may have longer ones."""


def submit_job(
    database: Database,
    parts: Parts,
    caller: Caller,
    body: Any,
    *,
    idempotency_key: str | None,
    now_s: float,
    settings: Settings,
    webhook: str | None = None,
) -> tuple[Job, bool]:
    """Store a job file as a job of the caller.

    Parameters
    ----------
    webhook
        The URL that gets a message when the job has ended.

    Notes
    -----
    Without `settings.sharing`, the job uses only scenes that the caller sees, and tiles of the same owner.

    Returns
    -------
    tuple[Job, bool]
        The row of the job, and whether it is new; an idempotent replay returns the job submitted earlier.

    Raises
    ------
    SpecError
        If the job is invalid or beyond a limit. The error names every field at fault.
    QuotaExceeded
        If the owner has too many open jobs.
    Invalid
        If the farm may not send to the URL of the webhook.
    StorageQuotaExceeded
        If the artifacts of the owner are too large.
    IdempotencyMismatch
        If the key was used with another job file.
    StoreFull, StoreUnavailable
        If the job cannot be stored. Then no row is written.
    """
    limits, sharing = Limits(settings, caller.limits), settings.sharing
    spec = parse_spec(body)
    host = _webhook_host(webhook, settings) if webhook is not None else None
    asked = body if webhook is None else [body, webhook]
    fingerprint = hashlib.sha256(json.dumps(asked, sort_keys=True).encode()).hexdigest()
    with database.reading() as session:
        known = _known(session, caller, idempotency_key, fingerprint)
        if known is not None:
            return known, False
        spec, lowered = limited_spec(spec, limits)
        check_quota(session, caller.owner_id, frames=len(spec.frame_numbers), limits=limits)
        sheet = resolve(session, spec, new_job_id(now_s), owner_id=caller.scope(sharing=sharing))
    notes = (*current_job(body)[1], *lowered, *check_job(sheet))
    # The artifact is written before the row, so that a crash in between leaves an unused file and no job without one.
    if database.reserve.is_given_up:
        raise StoreFull("The disk of the database has no room left, so no job can be stored.")
    if not sharing:
        sheet = sheet.model_copy(update={"cache_scope": caller.owner_id})
    # Workers of an earlier release refuse a field that they do not know. These two decide about dispatching alone.
    of_spec = later_defaults(sheet.spec) | {"slots": True, "workers": True}
    excluded: dict[str, Any] = {"spec": of_spec} | ({"cache_scope": True} if sharing else {})
    data = sheet.model_dump_json(indent=2, exclude=excluded).encode()
    parts.store.put_bytes(names.job_artifact(sheet.job_id, names.JOB_FILE), data)
    with database.writing() as session:
        known = _known(session, caller, idempotency_key, fingerprint)
        if known is not None:
            return known, False
        check_quota(session, caller.owner_id, frames=len(spec.frame_numbers), limits=limits)
        row = _insert(session, sheet, caller, list(notes), now_s, webhook, settings.webhook_url or None)
        detail = f"scene {row.scene}" + (f", webhook {host}" if host else "")
        record(session, caller, AuditAction.SUBMIT_JOB, row.id, now_s=now_s, detail=detail)
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
        return row, True


def _webhook_host(url: str, settings: Settings) -> str:
    try:
        return parse_receiver(url, rules_of(settings)).place
    except ReceiverRefused as error:
        problem = FieldProblem(field="webhook", expected="a URL that the farm may send to", got=str(error))
        raise Invalid(f"webhook: {error}", problems=[problem]) from error


def _known(session: Session, caller: Caller, key: str | None, fingerprint: str) -> Job | None:
    used = access_rows.idempotency(session, caller.key_id, key) if key is not None else None
    row = job_rows.job(session, used.job_id) if used is not None else None
    if used is not None and row is not None and used.fingerprint != fingerprint:
        raise IdempotencyMismatch(f"Idempotency-Key {key!r} was used for job {row.id}, which had another job file")
    return row


def resolve(session: Session, spec: JobSpec, job_id: str, *, owner_id: str | None = None) -> ResolvedJob:
    """Return a job together with its scene.

    Raises
    ------
    SpecError
        If the scene does not exist, is hidden from the given owner, or does not accept the parameters of the job.
    """
    try:
        scene = find_scene(session, spec.scene, owner_id=owner_id)
    except NotFound as error:
        hint = did_you_mean(session, spec.scene, owner_id=owner_id)
        problem = FieldProblem(field="scene", expected=f"the name of a scene on this farm{hint}", got=repr(spec.scene))
        raise SpecError.of([problem]) from error
    return ResolvedJob.of(job_id, spec, SceneManifest.model_validate(scene.card), bundle=scene.digest)


def _insert(
    session: Session, sheet: ResolvedJob, caller: Caller, notes: list[str], now_s: float, webhook: str | None,
    farm_webhook: str | None,
) -> Job:  # fmt: skip
    spec = sheet.spec
    row = Job(
        id=sheet.job_id,
        title=spec.title or spec.scene,
        scene=spec.scene,
        bundle=sheet.bundle,
        spec=spec.model_dump(mode="json", exclude=later_defaults(spec)),
        notes=notes,
        owner=caller.name[:OWNER_NAME],
        owner_id=caller.owner_id,
        status=JobStatus.QUEUED,
        priority=spec.priority,
        webhook_url=webhook,
        farm_webhook_url=farm_webhook,
        max_slots=caller.limits.slots,
        max_artifacts_mb=caller.limits.artifacts_mb,
        own_slots=spec.slots,
        requirement=sheet.requirement.text,
        created_s=now_s,
        frames_total=len(spec.frame_numbers),
    )
    session.add(row)
    session.flush()
    insert_tasks(session, row.id, [probe_task()])
    session.refresh(row)
    publish_jobs(session, [row])
    return row
