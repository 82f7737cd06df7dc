"""The four Celery tasks, by name. Each opens the message of an order and hands the order to `attempt`."""

from __future__ import annotations

import threading
import time
from functools import cache
from typing import Any

import structlog
from celery import Task
from celery.signals import task_failure, worker_process_shutdown, worker_ready

from lippmann.errors import LippmannError
from lippmann.job.messages.orders import TaskKind
from lippmann.job.messages.seals import Refused, Seals
from lippmann.job.messages.wire import task_name
from lippmann.plan.artifact_store import ArtifactStore, LeavesPartialFiles
from worker.app import app, broker_client, handover, settings
from worker.engines.choose import ENGINES
from worker.images.read import limit_threads
from worker.refusals import refusals
from worker.store.opening import open_store
from worker.tasks.attempts.attempt import TaskFunction, attempt
from worker.tasks.attempts.lost import report_if_lost, sweep_if_lost
from worker.tasks.attempts.sweep import sweep_scratch
from worker.tasks.attempts.workplace import Workplace, workplace
from worker.tasks.encode import encode_output
from worker.tasks.frames.assemble import assemble_frame
from worker.tasks.frames.render import render_tile
from worker.tasks.probe import probe_job

STALE_S = 86_400.0
"""A partial artifact older than this belongs to no running process."""

log = structlog.get_logger()


@app.task(name=task_name(TaskKind.PROBE), bind=True)
def probe(task: Task, *_: Any, order: object = None, **__: Any) -> None:
    """Render the first frame at low resolution."""
    _do(task, order, TaskKind.PROBE, probe_job)


@app.task(name=task_name(TaskKind.RENDER), bind=True)
def render(task: Task, *_: Any, order: object = None, **__: Any) -> None:
    """Render a frame or a tile of it."""
    _do(task, order, TaskKind.RENDER, render_tile)


@app.task(name=task_name(TaskKind.ASSEMBLE), bind=True)
def assemble(task: Task, *_: Any, order: object = None, **__: Any) -> None:
    """Assemble the tiles of a frame into its masters."""
    _do(task, order, TaskKind.ASSEMBLE, assemble_frame)


@app.task(name=task_name(TaskKind.ENCODE), bind=True)
def encode(task: Task, *_: Any, order: object = None, **__: Any) -> None:
    """Make one output of a job from its frames."""
    _do(task, order, TaskKind.ENCODE, encode_output)


def _do(task: Task, message: object, kind: TaskKind, do: TaskFunction) -> None:
    """Attempt the order in a message, unless it is refused."""
    try:
        order = _seals().open_order(message, kind=kind, attempt=str(task.request.id), now_s=time.time())
    except Refused as error:
        refusals.record(error)
        return
    attempt(this_workplace(), order, do)


@worker_ready.connect
def _sweep(**_: Any) -> None:
    """Begin to remove what killed workers left; the event loop of Celery goes on while a disk or a server is slow."""
    threading.Thread(target=sweep_scratch, args=(settings,), name="sweep-scratch", daemon=True).start()
    try:
        # Not in the thread: a process that is forked while the thread imports boto3 could never import it.
        store = open_store(settings)
    except LippmannError as error:
        return _log_unusable(error)
    threading.Thread(target=_sweep_store, args=(store,), name="sweep-store", daemon=True).start()


def _sweep_store(store: ArtifactStore) -> None:
    """Remove the partial artifacts of killed workers, and name what is wrong with the store."""
    try:
        if settings.store_url and store.identity() is None:
            log.warning("the store has no id: it is not that of a farm, or its service has not started yet",
                        store=settings.store_url)  # fmt: skip
        if isinstance(store, LeavesPartialFiles):
            store.sweep(older_than_s=STALE_S)
    except LippmannError as error:
        _log_unusable(error)


def _log_unusable(error: LippmannError) -> None:
    log.warning("the store cannot be used; attempts are tried again until it can", error=str(error))


@worker_process_shutdown.connect
def _end_engines(**_: Any) -> None:
    """End the programs that a pool process keeps, and remove their folders."""
    for engine in ENGINES.values():
        engine.end()


@task_failure.connect
def _report_lost(
    sender: Task | None = None,
    task_id: str | None = None,
    exception: BaseException | None = None,
    kwargs: dict[str, Any] | None = None,
    **_: Any,
) -> None:
    """Report, in the worker itself, an attempt whose pool process died, and remove its files."""
    kinds = {task_name(kind): kind for kind in TaskKind}
    if sender is not None and sender.name in kinds:
        report_if_lost(broker_client(), settings, exception, kwargs, kind=kinds[sender.name], attempt=str(task_id))
    sweep_if_lost(settings, exception)


@cache
def _seals() -> Seals:
    return settings.seals


@cache
def this_workplace() -> Workplace:
    """Return the workplace of this process, which is created in a pool process and never before the fork."""
    limit_threads(1)  # a slot is one core, for OpenImageIO too
    return workplace(settings, handover.announce)
