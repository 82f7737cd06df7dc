"""The log of an attempt, stored however the attempt ends."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from pathlib import Path

import structlog

from lippmann.errors import LippmannError
from lippmann.job.orders import Order
from lippmann.plan import artifact_names as names
from worker.sandbox.log import AttemptLog
from worker.tasks.workplace import Workplace

log = structlog.get_logger()


@contextlib.contextmanager
def kept_log(place: Workplace, order: Order, folder: Path) -> Iterator[AttemptLog]:
    """Yield an attempt's log and store it afterwards, after success and failure alike."""
    path = folder.with_name(f"{folder.name}.txt")
    try:
        with AttemptLog(path) as attempt_log:
            yield attempt_log
    finally:
        name = names.log_name(order.kind, order.frame, order.tile, order.output, order.attempt_number)
        # A log that cannot be stored must not hide how the attempt ended.
        try:
            place.store.put_file(names.job_artifact(order.job_id, name), path)
        except (LippmannError, OSError) as error:
            log.warning("attempt log not stored", job=order.job_id, name=name, error=str(error))
        path.unlink(missing_ok=True)
