"""A job watched until it ends."""

from __future__ import annotations

from lippmann.client import Client
from lippmann.errors import JobEnded
from lippmann.job.states import JobStatus
from lippmann.terminal.progress import ProgressLine, duration_text
from service.schemas.job import Job


def follow_job(client: Client, job_id: str) -> Job:
    """Show how far a job is until it ends; return it as it ended.

    Raises
    ------
    JobEnded
        If it failed or was cancelled: with its message.
    """
    job = client.job(job_id)
    with ProgressLine(job_id) as line:
        shown: tuple[JobStatus, int] | None = None
        for job in client.follow(job_id):
            news = (job.status, job.frames_done)
            line.show(job.progress, progress_words(job), news=news != shown)
            shown = news
    if job.status is not JobStatus.DONE:
        raise JobEnded(f"job {job.id} {ended_words(job)}")
    return job


def progress_words(job: Job) -> str:
    """Return where a job stands, as people say it: `running, 3 of 6 frames, 40 s to go`."""
    words = f"{job.status}, {job.frames_done} of {job.frames_total} frames"
    return f"{words}, {duration_text(job.eta_s)} to go" if job.eta_s is not None else words


def ended_words(job: Job) -> str:
    """Return how a job ended, with its message: `failed (scene): ...`."""
    return f"{job.status} ({job.error.code}): {job.error.message}" if job.error else str(job.status)
