"""A worker whose tasks do nothing, with all that surrounds a task."""

from __future__ import annotations

from lippmann.farm.worker import worker_arguments
from lippmann.job.messages.events import ProbeResult
from lippmann.job.messages.orders import Order, TaskKind
from worker.app import app, settings
from worker.tasks import entry
from worker.tasks.attempts.attempt import TaskResult
from worker.tasks.attempts.monitor import ProgressMonitor
from worker.tasks.attempts.workplace import Workplace


def _nothing(_place: Workplace, order: Order, _monitor: ProgressMonitor) -> TaskResult:
    probe = ProbeResult(start_s=0.5, s_per_px=1e-5, tileable=True) if order.kind is TaskKind.PROBE else None
    return TaskResult(probe=probe)


for work in ("probe_job", "render_tile", "assemble_frame", "encode_output"):
    assert hasattr(entry, work)
    setattr(entry, work, _nothing)

if __name__ == "__main__":
    app.worker_main(worker_arguments(name=settings.worker_name))
