"""The share of failed tasks above which a job fails."""

from __future__ import annotations

from collections.abc import Sequence

import pytest
from sqlalchemy import update

from lippmann.job.messages.orders import TaskKind
from lippmann.job.states import JobStatus, TaskStatus
from service.db.counters import recount
from service.db.tables import Job, Task
from service.jobs.completion import settle
from service.settings import FailureLimit
from tests.builders_service import Farm

OUTPUTS = ("views.mp4", "centre.mp4", "orthoscopic.mkv")
TASKS = 40
"""All tasks of the job below: probe, 12 frames of 2 tiles with their assemblies, 3 outputs."""


FEW_TASKS = 19
"""All tasks of a job of 6 frames without outputs."""


def _with_failed(farm: Farm, count: int, *, frames: str = "1-12", outputs: Sequence[str] = OUTPUTS) -> Job:
    """Return a running job of which `count` render tasks have failed and all others are ready or done."""
    job_id = farm.planned(frames=frames, outputs=list(outputs))
    renders = [task.sequence for task in farm.tasks(job_id) if task.kind is TaskKind.RENDER][:count]
    with farm.writing() as session:
        failed = update(Task).where(Task.job_id == job_id, Task.sequence.in_(renders))
        session.execute(failed.values(status=TaskStatus.FAILED, error_message="no light", error_code="render-failed"))
        recount(session, job_id)
    return farm.job(job_id)


@pytest.mark.parametrize(("failed", "ends"), [(0, False), (3, False), (4, False), (5, True)])
def test_a_job_fails_when_more_than_a_tenth_of_its_tasks_failed_and_not_at_a_tenth(
    farm: Farm, failed: int, ends: bool
) -> None:
    job_id = _with_failed(farm, failed).id
    assert len(farm.tasks(job_id)) == TASKS
    with farm.writing() as session:
        row = session.get_one(Job, job_id)
        assert settle(session, row, now_s=farm.now_s, limit=FailureLimit(share=0.1, least=3)) is ends
    job = farm.job(job_id)
    assert job.status is (JobStatus.FAILED if ends else JobStatus.RUNNING)
    if ends:
        assert job.error_message == "5 of 40 tasks failed, more than 10%; the first: no light"


@pytest.mark.parametrize(("failed", "ends"), [(2, False), (3, True)])
def test_two_failed_tasks_of_nineteen_are_too_few_to_end_a_job_though_they_are_more_than_a_tenth(
    farm: Farm, failed: int, ends: bool
) -> None:
    job_id = _with_failed(farm, failed, frames="1-6", outputs=()).id
    assert len(farm.tasks(job_id)) == FEW_TASKS
    with farm.writing() as session:
        assert (
            settle(session, session.get_one(Job, job_id), now_s=farm.now_s, limit=farm.settings.failure_limit) is ends
        )
    assert farm.job(job_id).status is (JobStatus.FAILED if ends else JobStatus.RUNNING)
