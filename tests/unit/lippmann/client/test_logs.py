"""Which logs are read, and in which order they come while a job runs."""

from __future__ import annotations

from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import pytest

from lippmann.client.errors import refusal
from lippmann.client.logs import follow_logs, read_logs
from lippmann.client.stream import ServerEvent
from lippmann.errors import JobEnded
from lippmann.job.messages.orders import TaskKind
from lippmann.job.states import TaskStatus


class Service:
    """A service with one job; its events change the tasks."""

    def __init__(self, *events: ServerEvent, **tasks: tuple[TaskStatus, int]) -> None:
        self.events_to_come = events
        self.now = tasks

    def task(self, job_id: str, task_id: str) -> Any:
        status, attempt = self.now[task_id]
        return SimpleNamespace(
            id=task_id, kind=TaskKind.RENDER, status=status, frame=1, tile=None, output=None, attempt_number=attempt
        )

    def tasks(self, job_id: str, *, status: str | None) -> Iterator[Any]:
        yield from (self.task(job_id, name) for name, now in self.now.items() if status in (None, now[0]))

    def log(self, job_id: str, task_id: str, *, attempt: int) -> str:
        if task_id == "lost":
            raise refusal(404, "", {"detail": "no log"})
        return f"log of {task_id}, attempt {attempt}"

    def events(self, job_id: str) -> Iterator[ServerEvent]:
        for event in self.events_to_come:
            if event.type == "task":
                self.now[event.data["id"]] = (TaskStatus(event.data["status"]), event.data["attempt_number"])
            yield event


def _job(**data: Any) -> ServerEvent:
    return ServerEvent("job", {"status": "running"} | data)


def _task(name: str, status: str, attempt: int) -> ServerEvent:
    return ServerEvent("task", {"id": name, "status": status, "attempt_number": attempt})


def test_tasks_without_a_log_are_left_out_and_a_limit_counts_logs() -> None:
    service: Any = Service(
        a=(TaskStatus.DONE, 1), b=(TaskStatus.WAITING, 0), lost=(TaskStatus.FAILED, 1), c=(TaskStatus.FAILED, 2)
    )
    assert [one.log for one in read_logs(service, "j")] == ["log of a, attempt 1", "log of c, attempt 2"]
    assert [one.task for one in read_logs(service, "j", limit=1)] == ["a"]
    assert [one.task for one in read_logs(service, "j", status="failed")] == ["c"]
    assert [one.task for one in read_logs(service, "j", task_id="c")] == ["c"]


def test_a_task_that_runs_again_has_the_log_of_the_attempt_before() -> None:
    service: Any = Service(a=(TaskStatus.RUNNING, 2), b=(TaskStatus.DISPATCHED, 1))
    assert [(one.task, one.attempt, one.log) for one in read_logs(service, "j")] == [("a", 1, "log of a, attempt 1")]


def test_the_logs_of_a_job_that_runs_come_once_each_until_it_ends() -> None:
    service: Any = Service(
        _job(),
        _task("b", "running", 1),
        ServerEvent("progress", {}),
        _task("b", "ready", 1),
        _task("b", "running", 2),
        ServerEvent("reset", {}),
        _task("b", "done", 2),
        _job(status="done"),
        _task("a", "done", 7),
        a=(TaskStatus.DONE, 1),
        b=(TaskStatus.READY, 0),
    )
    assert [one.log for one in follow_logs(service, "j")] == [
        "log of a, attempt 1",
        "log of b, attempt 1",
        "log of b, attempt 2",
    ]


def test_the_end_brings_what_no_event_told() -> None:
    service: Any = Service(_job(), _job(status="failed"), a=(TaskStatus.READY, 0))
    logs = follow_logs(service, "j")
    service.now["a"] = (TaskStatus.FAILED, 3)
    assert [(one.task, one.attempt) for one in logs] == [("a", 3)]


def test_a_job_that_is_removed_ends_the_following() -> None:
    service: Any = Service(_job(), ServerEvent("job", {"id": "j", "removed": True}))
    with pytest.raises(JobEnded, match="removed"):
        list(follow_logs(service, "j"))
