"""Submit, list, get, change and remove jobs."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any

from fastapi import APIRouter, Body, Header, Query, Response
from sqlalchemy.orm import Session

from lippmann.job.states import JobStatus
from service.api import listings
from service.api.presenters import present_job
from service.audit import record
from service.auth import Caller
from service.db.job_pages import JobQuery
from service.db.tables import Job as JobRow
from service.dependencies import (
    AppState,
    AppStateDep,
    CursorQuery,
    JobId,
    LimitQuery,
    OwnJobId,
    ScopeDep,
    SubmitterDep,
    ViewerDep,
)
from service.jobs.artifact_repair import repair_artifacts
from service.jobs.commands import (
    cancel_job,
    pause_job,
    prioritise_job,
    remove_job,
    repair_job,
    resume_job,
    retry_job,
    share_job,
    skip_frames,
)
from service.jobs.limits import check_quota
from service.jobs.skipping import remove_outputs_without_frames
from service.jobs.state_machine import find_job
from service.jobs.storage_quota import check_storage
from service.jobs.submission import submit_job
from service.limits import Limits
from service.routes.description import Responses, problems
from service.schemas.access import AuditAction
from service.schemas.job import FramesToSkip, Job, JobChange, JobPage, JobSort
from service.webhooks.receiver import MAX_URL

router = APIRouter(prefix="/jobs", tags=["jobs"])

MAX_OFFSET = 1_000_000
"""The largest number of jobs before a page."""

# The body is parsed by lippmann.job.spec, which alone checks job files; the contract only describes its schema.
JOB_FILE: dict[str, Any] = {
    "requestBody": {
        "required": True,
        "content": {"application/json": {"schema": {"$ref": "#/components/schemas/JobSpec"}}},
    }
}
_REPLAY: Responses = {200: {"model": Job, "description": "Idempotent replay: the job submitted earlier with this key."}}


@router.post("", status_code=201, openapi_extra=JOB_FILE, responses=_REPLAY)
def submit_job_file(
    state: AppStateDep,
    caller: SubmitterDep,
    body: Annotated[Any, Body()],
    response: Response,
    idempotency_key: Annotated[
        str | None,
        Header(min_length=1, max_length=200, description="A key chosen by the client. A repeated request with the same "
               "key and job file returns the job that was submitted first."),
    ] = None,
    webhook: Annotated[
        str | None,
        Query(min_length=1, max_length=MAX_URL, description="A URL that gets a signed `WebhookMessage` when the job is "
              "done, failed or cancelled."),
    ] = None,
) -> Job:  # fmt: skip
    """Submit a job file. The job is stored and runs as soon as workers are free."""
    row, is_new = submit_job(
        state.database, state.parts, caller, body, idempotency_key=idempotency_key, now_s=state.now_s(),
        settings=state.settings, webhook=webhook,
    )  # fmt: skip
    state.wakeup.notify()
    response.status_code = 201 if is_new else 200
    response.headers["Location"] = f"{state.settings.path_prefix}/api/v1/jobs/{row.id}"
    with state.database.reading() as session:
        return present_job(session, row, state.outlook())


@router.get("")
def list_jobs(
    state: AppStateDep,
    scope: ScopeDep,
    limit: LimitQuery = 50,
    cursor: CursorQuery = None,
    offset: Annotated[
        int, Query(ge=0, le=MAX_OFFSET, description="The number of jobs before the page, instead of a `cursor`.")
    ] = 0,
    status: Annotated[
        list[JobStatus] | None, Query(max_length=len(JobStatus), description="List only jobs with this status, or with "
              "one of several.")
    ] = None,
    owner: Annotated[
        str | None, Query(min_length=1, max_length=100, description="List only jobs of the owner of this name or id.")
    ] = None,
    search: Annotated[
        str | None, Query(min_length=1, max_length=100, description="List only jobs with this text in their title, "
              "scene, owner or id; upper and lower case are the same.")
    ] = None,
    sort: Annotated[JobSort, Query(description="The value by which the jobs are sorted.")] = JobSort.CREATED,
    ascending: Annotated[bool, Query(description="True to begin with the lowest value.")] = False,
    count: Annotated[bool, Query(description="True to count the jobs on all pages, as `total`.")] = False,
) -> JobPage:  # fmt: skip
    """List jobs, newest first unless `sort` says otherwise."""
    outlook = state.outlook()
    query = JobQuery(
        statuses=tuple(status or ()), owner=owner, search=search, seen_by=scope, sort=sort, ascending=ascending
    )
    with state.database.reading() as session:
        return listings.page_jobs(session, query, outlook, cursor=cursor, offset=offset, limit=limit, counted=count)


@router.get("/{job_id}")
def get_job(job_id: JobId, state: AppStateDep, _caller: ViewerDep) -> Job:
    """Get a job."""
    outlook = state.outlook()
    with state.database.reading() as session:
        return present_job(session, find_job(session, job_id), outlook)


@router.patch("/{job_id}", responses=problems(409))
def change_job(job_id: OwnJobId, change: JobChange, state: AppStateDep, caller: SubmitterDep) -> Job:
    """Change the priority of a job, or who sees it."""
    outlook, now_s = state.outlook(), state.now_s()

    def work(session: Session) -> Job:
        if change.priority is not None:
            prioritise_job(session, job_id, change.priority)
            detail = f"priority {change.priority}"
            record(session, caller, AuditAction.PRIORITISE_JOB, job_id, now_s=now_s, detail=detail)
        if change.shared is not None:
            share_job(session, job_id, shared=change.shared)
            detail = "seen by all" if change.shared else "seen by its owner"
            record(session, caller, AuditAction.SHARE_JOB, job_id, now_s=now_s, detail=detail)
        return present_job(session, find_job(session, job_id), outlook)

    job = state.database.write_in_reserve(work)
    state.wakeup.notify()
    return job


@router.post("/{job_id}/cancel", responses=problems(409))
def cancel(job_id: OwnJobId, state: AppStateDep, caller: SubmitterDep) -> Job:
    """Cancel a job. Running tasks are stopped; finished frames and outputs stay."""
    return _command(
        state, caller, AuditAction.CANCEL_JOB, job_id, lambda session: cancel_job(session, job_id, now_s=state.now_s())
    )


@router.post("/{job_id}/pause", responses=problems(409))
def pause(job_id: OwnJobId, state: AppStateDep, caller: SubmitterDep) -> Job:
    """Pause a job. No further tasks are dispatched; running tasks finish."""
    return _command(
        state, caller, AuditAction.PAUSE_JOB, job_id, lambda session: pause_job(session, job_id, now_s=state.now_s())
    )


@router.post("/{job_id}/resume", responses=problems(409))
def resume(job_id: OwnJobId, state: AppStateDep, caller: SubmitterDep) -> Job:
    """Resume a paused job."""
    limit = state.settings.failure_limit
    return _command(
        state,
        caller,
        AuditAction.RESUME_JOB,
        job_id,
        lambda session: resume_job(session, job_id, now_s=state.now_s(), limit=limit),
    )


@router.post("/{job_id}/retry", responses=problems(409))
def retry(job_id: OwnJobId, state: AppStateDep, caller: SubmitterDep) -> Job:
    """Retry a failed or cancelled job. Tasks that are not done run again, and so do those with unreadable artifacts.

    Skipped frames are rendered, and the outputs are made again with them; for this, a done job can be retried too.
    """
    limit = state.settings.failure_limit
    with state.database.reading() as session:  # before anything is deleted
        _check_reopening(session, job_id, Limits(state.settings, caller.limits))
    repair_artifacts(state.database, state.parts.store, job_id)
    remove_outputs_without_frames(state.database, state.parts.store, job_id)
    return _command(
        state,
        caller,
        AuditAction.RETRY_JOB,
        job_id,
        lambda session: retry_job(session, job_id, now_s=state.now_s(), limit=limit),
    )


@router.post("/{job_id}/repair", responses=problems(409))
def repair(job_id: OwnJobId, state: AppStateDep, caller: SubmitterDep) -> Job:
    """Verify every artifact of an ended job, and make the missing and damaged ones again.

    A failed or cancelled job also continues with its tasks that are not done, as after a retry.
    """
    return _command(state, caller, AuditAction.REPAIR_JOB, job_id, lambda session: repair_job(session, job_id))


@router.post("/{job_id}/skip", responses=problems(409))
def skip(
    job_id: OwnJobId, state: AppStateDep, caller: SubmitterDep, selection: Annotated[FramesToSkip | None, Body()] = None
) -> Job:
    """Leave frames of a failed or cancelled job out, by default those that failed, and continue the job.

    The outputs are made without these frames. A retry brings them back.
    """
    frames, limit = selection.frames if selection else None, state.settings.failure_limit
    return _command(
        state,
        caller,
        AuditAction.SKIP_FRAMES,
        job_id,
        lambda session: skip_frames(session, job_id, frames, now_s=state.now_s(), limit=limit),
    )


@router.delete("/{job_id}", status_code=204, responses=problems(409))
def remove(job_id: OwnJobId, state: AppStateDep, caller: SubmitterDep) -> None:
    """Remove an ended job and its artifacts."""

    def work(session: Session) -> None:
        remove_job(session, job_id)
        record(session, caller, AuditAction.REMOVE_JOB, job_id, now_s=state.now_s())

    state.database.write_in_reserve(work)
    state.wakeup.notify()


_REOPENS = frozenset({AuditAction.RETRY_JOB, AuditAction.REPAIR_JOB, AuditAction.SKIP_FRAMES})
"""The actions that open a job which has ended, and so count against the quota of its owner."""


def _check_reopening(session: Session, job_id: str, limits: Limits) -> None:
    was = find_job(session, job_id)
    check_quota(session, was.owner_id, frames=was.frames_total, limits=limits)


def _command(
    state: AppState,
    caller: Caller,
    action: AuditAction,
    job_id: str,
    run: Callable[[Session], JobRow],
    detail: str = "",
) -> Job:
    outlook = state.outlook()

    def work(session: Session) -> Job:
        limits = Limits(state.settings, caller.limits)
        if action in _REOPENS:
            _check_reopening(session, job_id, limits)
        if action is AuditAction.RESUME_JOB:
            check_storage(session, find_job(session, job_id).owner_id, limits=limits)
        row = run(session)
        record(session, caller, action, job_id, now_s=state.now_s(), detail=detail)
        return present_job(session, row, outlook)

    job = state.database.write_in_reserve(work)
    state.wakeup.notify()
    return job
