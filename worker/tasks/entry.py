"""The four Celery tasks, by name. Each decodes an order and hands it to `attempt`."""

from __future__ import annotations

from functools import cache
from typing import Any

from celery.signals import task_failure, worker_ready

from lippmann.job.messages.orders import Order, TaskKind
from lippmann.job.messages.wire import task_name
from worker.app import app, broker_client, handover, settings
from worker.images.read import limit_threads
from worker.store.local import LocalStore
from worker.tasks.assemble import assemble_frame
from worker.tasks.attempt import attempt
from worker.tasks.encode import encode_output
from worker.tasks.lost import report_if_lost, sweep_if_lost
from worker.tasks.probe import probe_job
from worker.tasks.render import render_tile
from worker.tasks.workplace import Workplace, sweep_scratch, workplace

STALE_S = 86_400.0
"""A partial artifact older than this belongs to no running process."""


@app.task(name=task_name(TaskKind.PROBE))
def probe(order: dict[str, Any]) -> None:
    """Render the first frame at low resolution."""
    attempt(this_workplace(), Order.model_validate(order), probe_job)


@app.task(name=task_name(TaskKind.RENDER))
def render(order: dict[str, Any]) -> None:
    """Render a frame or a tile of it."""
    attempt(this_workplace(), Order.model_validate(order), render_tile)


@app.task(name=task_name(TaskKind.ASSEMBLE))
def assemble(order: dict[str, Any]) -> None:
    """Assemble the tiles of a frame into its masters."""
    attempt(this_workplace(), Order.model_validate(order), assemble_frame)


@app.task(name=task_name(TaskKind.ENCODE))
def encode(order: dict[str, Any]) -> None:
    """Make one output of a job from its frames."""
    attempt(this_workplace(), Order.model_validate(order), encode_output)


@worker_ready.connect
def _sweep(**_: Any) -> None:
    """Remove the scratch folders and partial artifacts of killed workers."""
    sweep_scratch(settings)
    LocalStore(settings.artifacts_dir).sweep(older_than_s=STALE_S)


@task_failure.connect
def _report_lost(exception: BaseException | None = None, kwargs: dict[str, Any] | None = None, **_: Any) -> None:
    """Report, in the worker itself, an attempt whose pool process died, and remove its files."""
    report_if_lost(broker_client(), settings, exception, kwargs)
    sweep_if_lost(settings, exception)


@cache
def this_workplace() -> Workplace:
    """Return the workplace of this process, which is created in a pool process and never before the fork."""
    limit_threads(1)  # a slot is one core, for OpenImageIO too
    return workplace(settings, handover.announce)
