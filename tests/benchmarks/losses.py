"""How long a task waits after its process was killed, until it runs again."""

from __future__ import annotations

import math
import os
import signal
import time
from pathlib import Path

from lippmann.farm.supervisor.child import STEADY_S
from service.schemas.farm import Worker
from tests.builders import small_job
from tests.farm import Farm, busy_children, farm_up
from tests.waiting import until

KILLS = 20
SLOTS = 2
POLL_S = 0.1
ENVIRONMENT = {"LIPPMANN_LOSSES_ALLOWED": "1000"}
JOB = small_job("fish", count=(90, 90), frames=f"1-{SLOTS}", outputs=[], render={"cache": False})
"""A frame of some seconds for each slot. Nothing else waits for a slot, so the figures hold no time in the queue."""


def recovery_p95(folder: Path) -> str:
    """Return the 95th percentile of the recovery of kills, of pool processes and of whole workers in turn."""
    with farm_up(folder / "data", slots=SLOTS, env=ENVIRONMENT) as farm:
        taken_s = sorted(recovery_s(farm, whole_worker=number % 2 == 1) for number in range(KILLS))
    return f"{taken_s[math.ceil(0.95 * KILLS) - 1]:.1f} s (median {taken_s[KILLS // 2]:.1f} s)"


def recovery_s(farm: Farm, *, whole_worker: bool) -> float:
    """Return the seconds from a kill until each task that ran in what was killed runs again."""
    if whole_worker:  # the supervisor makes a pause of its own before it restarts what dies again at once
        (worker,) = until(lambda: farm.client.workers().items)
        time.sleep(max(0.0, STEADY_S - (time.time() - worker.started_s)))
    job_id = farm.client.submit(JOB).id
    hit = until(lambda: running(farm, job_id))
    worker, children = until(lambda: busy_worker(farm))
    repeated: set[int] = set()

    def is_repeated() -> bool:
        for sequence, attempt_number in attempts(farm, job_id).items():
            if attempt_number > hit.get(sequence, math.inf):
                repeated.add(sequence)
        time.sleep(POLL_S)
        return len(repeated) == (SLOTS if whole_worker else 1)

    begun_s = time.monotonic()
    os.kill(worker.pid if whole_worker else children[0], signal.SIGKILL)
    until(is_repeated)
    taken_s = time.monotonic() - begun_s
    farm.client.cancel(job_id)
    return taken_s


def busy_worker(farm: Farm) -> tuple[Worker, list[int]] | None:
    """Return the worker with its pool processes, if all of them render."""
    for worker in farm.client.workers().items:
        children = busy_children(worker.pid)
        if len(children) == SLOTS:
            return worker, children
    return None


def running(farm: Farm, job_id: str) -> dict[int, int]:
    """Return the tasks that run, if no slot is free."""
    found = attempts(farm, job_id)
    return found if len(found) == SLOTS else {}


def attempts(farm: Farm, job_id: str) -> dict[int, int]:
    """Return the numbers of the attempts that run, by task."""
    return {task.sequence: task.attempt_number for task in farm.client.tasks(job_id, status="running")}
