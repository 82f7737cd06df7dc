"""The worker as a process: Celery with its command line and environment."""

from __future__ import annotations

import os
import platform

from lippmann.descriptors import raise_descriptor_limit


def worker_name() -> str:
    """Return the name of the worker that this process becomes."""
    return os.environ.get("LIPPMANN_WORKER_NAME") or f"{platform.node()}-{os.getpid()}"


def worker_arguments(*, name: str) -> list[str]:
    """Return Celery's command line for one worker; its application sets its queues and the number of its processes.

    Gossip, mingle and heartbeats are Celery's own messages among workers, and nothing here reads them.
    """
    return [
        "worker",
        *("--pool", "prefork"),
        *("--hostname", name),
        *("--loglevel", "INFO"),
        *("-O", "fair"),
        "--without-gossip",
        "--without-mingle",
        "--without-heartbeat",
    ]


def run_worker(*, slots: int) -> None:
    """Run a worker until it is stopped; the process then ends."""
    raise_descriptor_limit()  # Each process of the pool has the pipes of all others.
    name = worker_name()
    # The worker's settings read the environment when they are imported.
    os.environ |= {"LIPPMANN_WORKER_NAME": name, "LIPPMANN_SLOTS": str(slots)}
    # This must be set before NumPy is imported: a slot is one core, for matrix products too.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    from worker.app import EXIT_REFUSED, app, is_key_refused

    try:
        app.worker_main(worker_arguments(name=name))
    finally:
        if is_key_refused.is_set():
            raise SystemExit(EXIT_REFUSED)
