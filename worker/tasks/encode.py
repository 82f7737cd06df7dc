"""Frames into one of the outputs that a job asks for."""

from __future__ import annotations

from lippmann.job.messages.orders import Order
from lippmann.job.outputs.choice import output_called
from worker.tasks.attempts.artifacts import TaskArtifacts
from worker.tasks.attempts.attempt import TaskResult
from worker.tasks.attempts.monitor import ProgressMonitor
from worker.tasks.attempts.workplace import Workplace
from worker.tasks.outputs.context import OutputContext
from worker.tasks.outputs.frame_source import job_frames
from worker.tasks.outputs.registry import make_output


def encode_output(place: Workplace, order: Order, monitor: ProgressMonitor) -> TaskResult:
    """Make the output that an order names; files that an earlier attempt has stored are not made again."""
    assert order.output is not None  # noqa: S101 - the dispatcher's promise
    sheet = place.job_sheet(order.job_id)
    artifacts = TaskArtifacts(place.store, order, monitor)
    with place.task_folder() as folder:
        make_output(
            OutputContext(
                source=job_frames(artifacts, sheet, skipped=frozenset(order.skipped_frames)),
                output=output_called(sheet.spec.outputs, order.output),
                scratch=folder,
                put=artifacts.put,
                exists=artifacts.exists,
                monitor=monitor,
            )
        )
    return TaskResult(digests=artifacts.stored)
