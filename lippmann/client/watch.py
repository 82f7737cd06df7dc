"""Watch a job until it ends, with its progress on stderr."""

from __future__ import annotations

from lippmann.client import Client
from lippmann.errors import JobEnded
from lippmann.job.states import JobStatus
from lippmann.terminal.progress import ProgressLine, duration_text
from service.schemas.job import Job


def watch_job(client: Client, job_id: str) -> Job:
    """Print the progress of a job until it ends, and return the ended job.

    Raises
    ------
    JobEnded
        If the job failed or was cancelled, with its message.
    """
    job = client.job(job_id)
    with ProgressLine(job_id) as line:
        printed: tuple[JobStatus, int] | None = None
        for job in client.follow(job_id):
            news = (job.status, job.frames_done)
            line.show(job.progress, progress_text(job), news=news != printed)
            printed = news
    if job.status is not JobStatus.DONE:
        raise JobEnded(f"job {job.id} {ending_text(job)}")
    return job


def progress_text(job: Job) -> str:
    """Return the progress of a job as text, for example `running, 3 of 6 frames, 40 s to go`.

    A job that the farm has paused says why.
    """
    text = f"{job.status}, {job.frames_done} of {job.frames_total} frames"
    if job.pause is not None and job.pause.reason:
        return f"{text}, paused by the {job.pause.by}: {job.pause.reason}"
    return f"{text}, {duration_text(job.eta_s)} to go" if job.eta_s is not None else text


def ending_text(job: Job) -> str:
    """Return how a job ended as text, for example `failed (scene): ...`."""
    return f"{job.status} ({job.error.code}): {job.error.message}" if job.error else str(job.status)
