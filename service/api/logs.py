"""The log of an attempt."""

from __future__ import annotations

from sqlalchemy.orm import Session

from lippmann.plan import artifact_names as names
from service.api.listings import find_task
from service.api.presenters import tile_of
from service.errors import NotFound
from service.ports import ArtifactStore


def find_log(session: Session, store: ArtifactStore, job_id: str, task_id: str, *, attempt: int | None) -> str:
    """Return the full name of an attempt's log: of the latest that left one when none is said.

    Raises
    ------
    NotFound
        If there is none.
    """
    row = find_task(session, job_id, task_id)
    numbers = [attempt] if attempt is not None else range(row.attempt_number, 0, -1)
    for number in numbers:
        name = names.job_artifact(job_id, names.log_name(row.kind, row.frame, tile_of(row), row.output, number))
        if store.exists(name):
            return name
    raise NotFound(f"task {task_id!r} has left no log yet" if attempt is None else f"attempt {attempt} left no log")
