"""Submit, list, show, move and remove jobs."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Body, Header, Response

from lippmann.job.states import JobStatus
from service.api import listings as browse
from service.api import presenters as show
from service.dependencies import CursorQuery, HouseDep, LimitQuery, SessionDep, SubmitterDep, ViewerDep
from service.jobs.artifact_repair import mend_job
from service.jobs.cancel import cancel_job
from service.jobs.pause import pause_job, resume_job
from service.jobs.prioritise import prioritise_job
from service.jobs.remove import remove_job
from service.jobs.retry import retry_job
from service.jobs.state_machine import find_job
from service.jobs.submission import submit_job
from service.schemas.job import Job, JobChange, JobPage

router = APIRouter(prefix="/jobs", tags=["jobs"])

# The body is checked by lippmann.job.spec, the one door for job files; the contract says its form.
JOB_FILE: dict[str, Any] = {
    "requestBody": {
        "required": True,
        "content": {"application/json": {"schema": {"$ref": "#/components/schemas/JobSpec"}}},
    }
}


@router.post(
    "", status_code=201, openapi_extra=JOB_FILE, responses={200: {"model": Job, "description": "Said before."}}
)
def submit(
    house: HouseDep,
    caller: SubmitterDep,
    body: Annotated[Any, Body()],
    response: Response,
    idempotency_key: Annotated[str | None, Header(min_length=1, max_length=200)] = None,
) -> Job:
    """Submit a job file."""
    job, is_new = submit_job(
        house.database, house.parts, caller, body, idempotency_key=idempotency_key, now_s=house.now_s()
    )
    house.bell.ring()
    response.status_code = 201 if is_new else 200
    response.headers["Location"] = f"/api/v1/jobs/{job.id}"
    return job


@router.get("")
def list_jobs(
    session: SessionDep,
    _caller: ViewerDep,
    limit: LimitQuery = 50,
    cursor: CursorQuery = None,
    status: JobStatus | None = None,
) -> JobPage:
    """List jobs, newest first."""
    return browse.page_jobs(session, status=status, cursor=cursor, limit=limit)


@router.get("/{job_id}")
def show_job(job_id: str, session: SessionDep, _caller: ViewerDep) -> Job:
    """Show a job."""
    return show.show_job(session, find_job(session, job_id))


@router.patch("/{job_id}")
def change_job(job_id: str, change: JobChange, house: HouseDep, _caller: SubmitterDep) -> Job:
    """Change a job's priority."""
    with house.database.writing() as session:
        job = show.show_job(session, prioritise_job(session, job_id, change.priority))
    house.bell.ring()
    return job


@router.post("/{job_id}/cancel")
def cancel(job_id: str, house: HouseDep, _caller: SubmitterDep) -> Job:
    """End a job."""
    with house.database.writing() as session:
        job = show.show_job(session, cancel_job(session, job_id, now_s=house.now_s()))
    house.bell.ring()
    return job


@router.post("/{job_id}/pause")
def pause(job_id: str, house: HouseDep, _caller: SubmitterDep) -> Job:
    """Let a job rest: nothing new goes out, what runs ends."""
    with house.database.writing() as session:
        job = show.show_job(session, pause_job(session, job_id, now_s=house.now_s()))
    house.bell.ring()
    return job


@router.post("/{job_id}/resume")
def resume(job_id: str, house: HouseDep, _caller: SubmitterDep) -> Job:
    """Let a paused job go on."""
    share = house.settings.failed_share
    with house.database.writing() as session:
        job = show.show_job(session, resume_job(session, job_id, now_s=house.now_s(), failed_share=share))
    house.bell.ring()
    return job


@router.post("/{job_id}/retry")
def retry(job_id: str, house: HouseDep, _caller: SubmitterDep) -> Job:
    """Let a failed or cancelled job go on with what is not done, and with what can no longer be read."""
    share = house.settings.failed_share
    mend_job(house.database, house.parts.store, job_id)
    with house.database.writing() as session:
        job = show.show_job(session, retry_job(session, job_id, now_s=house.now_s(), failed_share=share))
    house.bell.ring()
    return job


@router.delete("/{job_id}", status_code=204)
def remove(job_id: str, house: HouseDep, _caller: SubmitterDep) -> None:
    """Forget an ended job and its artifacts."""
    with house.database.writing() as session:
        remove_job(session, job_id)
    house.bell.ring()
