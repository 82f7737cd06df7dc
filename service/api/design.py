"""The design of a job file, computed without storing anything."""

from __future__ import annotations

from typing import Any

from lippmann.job.fields.old_names import current_job
from lippmann.job.resolved import ResolvedJob
from lippmann.job.spec import parse_spec
from lippmann.plan.design.designer import design, drawing
from service.db.engine import Database
from service.jobs.submission import resolve
from service.schemas.design import Design


def design_job(database: Database, body: Any, *, frame: int | None, owner_id: str | None = None) -> Design:
    """Compute the design of a job file at a frame, by default the first.

    Raises
    ------
    SpecError
        If the job is invalid, as in a submission. The error names every field at fault.
    """
    designed = design(_sheet(database, body, owner_id), frame=frame)
    return designed.model_copy(update={"warnings": (*current_job(body)[1], *designed.warnings)})


def draw_job(database: Database, body: Any, *, frame: int | None, owner_id: str | None = None) -> str:
    """Draw the optical bench of a job file as SVG.

    Raises
    ------
    SpecError
        If the job is invalid, as in `design_job`.
    """
    return drawing(_sheet(database, body, owner_id), frame=frame)


def _sheet(database: Database, body: Any, owner_id: str | None) -> ResolvedJob:
    spec = parse_spec(body)
    # The connection is returned before the computation, which may take longer than many requests.
    with database.reading() as session:
        return resolve(session, spec, "design", owner_id=owner_id)
