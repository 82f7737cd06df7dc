"""A worker as a process: Celery, told what it needs to know."""

from __future__ import annotations

import os
import platform

from lippmann.job import wire


def worker_name() -> str:
    """Return the name of the worker that this process becomes."""
    return os.environ.get("LIPPMANN_WORKER_NAME") or f"{platform.node()}-{os.getpid()}"


def worker_arguments(*, slots: int, name: str) -> list[str]:
    """Return Celery's command line for one worker.

    Gossip, mingle and heartbeats are Celery's own talk among workers, which nobody listens to here.
    """
    return [
        "worker",
        *("--pool", "prefork"),
        *("--concurrency", str(slots)),
        *("--queues", wire.QUEUE),
        *("--hostname", name),
        *("--loglevel", "INFO"),
        *("-O", "fair"),
        "--without-gossip",
        "--without-mingle",
        "--without-heartbeat",
    ]


def run_worker(*, slots: int) -> None:
    """Become a worker, until told to stop; ends the process."""
    name = worker_name()
    # Before the worker's settings are imported: they read the environment then.
    os.environ |= {"LIPPMANN_WORKER_NAME": name, "LIPPMANN_SLOTS": str(slots)}
    # Before NumPy is: a slot is a core, for matrix products too.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    from worker.app import app

    app.worker_main(worker_arguments(slots=slots, name=name))
