"""A worker of bare Celery, whose tasks count that they were executed: the least that a task can do."""

from __future__ import annotations

import os

from celery import Celery
from redis import Redis

BARE = "benchmark.bare"
QUEUE = "benchmark"
COUNTED = "benchmark:bare"
"""The key in which the broker counts the tasks that were executed."""


def bare_app(broker_url: str) -> Celery:
    """Return an app of Celery with its default settings, except that no result is kept."""
    app = Celery("benchmark", broker=broker_url, set_as_current=False)
    app.conf.update(task_ignore_result=True, task_default_queue=QUEUE)
    return app


if __name__ == "__main__":
    url = os.environ["BENCHMARK_BROKER"]
    client = Redis.from_url(url)

    def count() -> None:
        """Count that the task was executed."""
        client.incr(COUNTED)

    app = bare_app(url)
    app.task(name=BARE)(count)
    app.worker_main(["worker", "--loglevel=WARNING", f"--concurrency={os.environ['BENCHMARK_SLOTS']}"])
