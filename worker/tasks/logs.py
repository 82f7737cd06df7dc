"""A log for every attempt, kept whatever happens."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from pathlib import Path

from lippmann.errors import LippmannError
from lippmann.job.orders import Order
from lippmann.plan import artifact_names as names
from worker.sandbox.log import AttemptLog
from worker.tasks.workplace import Workplace


@contextlib.contextmanager
def kept_log(place: Workplace, order: Order, folder: Path) -> Iterator[AttemptLog]:
    """Lend a log file and store what was written to it, after success and failure alike."""
    path = folder.with_name(f"{folder.name}.txt")
    try:
        with AttemptLog(path) as log:
            yield log
    finally:
        name = names.log_name(order.kind, order.frame, order.tile, order.output, order.attempt_number)
        # A log that cannot be kept must not hide how the attempt ended.
        with contextlib.suppress(LippmannError, OSError):
            place.store.put_file(names.job_artifact(order.job_id, name), path)
        path.unlink(missing_ok=True)
