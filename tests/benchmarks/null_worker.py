"""A worker whose tasks do nothing, with all that surrounds a task; and bare Celery tasks beside them."""

from __future__ import annotations

from typing import Any

from redis import Redis

from lippmann.farm.worker import worker_arguments
from lippmann.job.messages.events import ProbeResult
from lippmann.job.messages.orders import Order, TaskKind
from lippmann.job.messages.wire import task_name
from tests.benchmarks.celery_tasks import BARE, COUNTED
from worker.app import app, settings
from worker.tasks.attempt import TaskResult, attempt
from worker.tasks.entry import this_workplace
from worker.tasks.monitor import ProgressMonitor
from worker.tasks.workplace import Workplace


def _nothing(_place: Workplace, order: Order, _monitor: ProgressMonitor) -> TaskResult:
    probe = ProbeResult(start_s=0.5, s_per_px=1e-5, tileable=True) if order.kind is TaskKind.PROBE else None
    return TaskResult(probe=probe)


def _task(order: dict[str, Any]) -> None:
    attempt(this_workplace(), Order.model_validate(order), _nothing)


_redis = Redis.from_url(settings.redis_url)


def _bare(order: dict[str, Any]) -> None:
    """Count that the task was executed, which is the least that a task can do."""
    _redis.incr(COUNTED)


for kind in TaskKind:
    app.tasks.pop(task_name(kind), None)
    app.task(name=task_name(kind))(_task)
app.task(name=BARE)(_bare)

if __name__ == "__main__":
    app.worker_main(worker_arguments(name=settings.worker_name))
