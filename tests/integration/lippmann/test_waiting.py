"""Why jobs and tasks wait, as the API and the command tell it of a real farm."""

from __future__ import annotations

import json

from lippmann.client import Client
from service.schemas.wait import Wait
from tests.builders import small_job
from tests.integration.lippmann.conftest import Up, run
from tests.needs import needs_povray
from tests.waiting import until

pytestmark = needs_povray

SLOW = small_job("fish", count=(60, 60), frames="1-40").model_copy(update={"outputs": ()})
"""A job that holds both slots for a long time."""


def wait_of(client: Client, job_id: str, *codes: str) -> Wait:
    """Return the reason of a job once it has one of some codes."""

    def asked() -> Wait | None:
        wait = client.job(job_id).wait
        return wait if wait is not None and wait.code in codes else None

    found = until(asked)
    assert isinstance(found, Wait)
    return found


def test_the_api_and_the_command_say_why_jobs_and_tasks_wait(farm: Up) -> None:
    at = ("--data-dir", str(farm.data_dir))
    with farm.client() as client:
        busy = client.submit(SLOW)
        until(lambda: client.job(busy.id).tasks.running == 2 and client.job(busy.id).status == "running")
        client.prioritise(busy.id, 90)
        job = client.submit(SLOW)
        wait = wait_of(client, job.id, "higher-priority")
        assert wait.jobs == (busy.id,)
        assert wait.message in run("show", job.id, *at).stdout
        assert "higher-priority" in run("jobs", *at).stdout
        (probe,) = json.loads(run("tasks", job.id, "--json", *at).stdout)
        assert (probe["kind"], probe["wait"]["code"]) == ("probe", "higher-priority")

        reasons = {task.wait.code for task in client.tasks(busy.id) if task.wait is not None}
        assert (
            {"earlier-stage", "earlier-tasks"}
            <= reasons
            <= {"earlier-stage", "earlier-tasks", "order-sent", "starting"}
        )
        waiting = run("tasks", busy.id, "--status", "waiting", "--limit", "1", *at).stdout
        assert "of the stage render/" in waiting

        client.pause(busy.id)
        assert client.job(busy.id).wait is not None
        assert wait_of(client, busy.id, "paused").jobs == ()
        until(lambda: client.job(job.id).tasks.running or client.job(job.id).status == "running")
        client.cancel(job.id)
        assert client.cancel(busy.id).wait is None
        assert client.job(job.id).wait is None
