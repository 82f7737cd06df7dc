"""Actions of users while a job renders."""

from __future__ import annotations

from random import Random

from tests.builders import small_job
from tests.chaos.kinds.kind import Kinds, pause
from tests.chaos.parts import Parts
from tests.waiting import until

KINDS = Kinds()


@KINDS.of("user: pauses and resumes five times")
def _paused(parts: Parts, job_id: str, rng: Random) -> None:
    for _ in range(5):
        parts.client.pause(job_id)
        pause(rng, 0.0, 3.0)
        parts.client.resume(job_id)
        pause(rng, 0.0, 3.0)


@KINDS.of("user: cancels and retries")
def _cancelled(parts: Parts, job_id: str, rng: Random) -> None:
    parts.client.cancel(job_id)
    until(lambda: parts.client.job(job_id).status == "cancelled", every_s=0.1)
    parts.client.retry(job_id)


@KINDS.of("user: a second job comes before it, is cancelled and removed")
def _second_job(parts: Parts, job_id: str, rng: Random) -> None:
    other = parts.client.submit(small_job("fish", frames="1-3", priority=90))
    pause(rng, 0.0, 8.0)
    if "cancel" in parts.client.job(other.id).actions:
        parts.client.cancel(other.id)
    until(lambda: parts.client.job(other.id).status in ("cancelled", "done"), every_s=0.1)
    parts.client.delete(other.id)
