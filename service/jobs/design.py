"""What a job will give, before it is submitted; nothing is kept."""

from __future__ import annotations

from typing import Any

from lippmann.job.old_names import current_job
from lippmann.job.resolved import JobSheet
from lippmann.job.spec import parse_spec
from lippmann.plan.design.designer import design, drawing
from service.db.engine import Database
from service.jobs.submission import resolved
from service.schemas.design import Design


def design_job(database: Database, body: Any, *, frame: int | None) -> Design:
    """Return the design of a job file at a frame, the first one when not said.

    Raises
    ------
    SpecError
        Naming every field that cannot be, as when it is submitted.
    """
    designed = design(_sheet(database, body), frame=frame)
    return designed.model_copy(update={"warnings": (*current_job(body)[1], *designed.warnings)})


def draw_job(database: Database, body: Any, *, frame: int | None) -> str:
    """Return the drawing of a job file's bench as SVG.

    Raises
    ------
    SpecError
        As `design_job`.
    """
    return drawing(_sheet(database, body), frame=frame)


def _sheet(database: Database, body: Any) -> JobSheet:
    spec = parse_spec(body)
    # Given back before anything is computed: a design may take longer than many requests.
    with database.reading() as session:
        return resolved(session, spec, "design")
