"""The design of a job file, and what a submission would say to it; nothing is stored."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from sqlalchemy.orm import Session

from lippmann.errors import FieldProblem, SpecError
from lippmann.job.fields.old_names import current_job
from lippmann.job.resolved import ResolvedJob
from lippmann.job.spec import JobSpec, parse_spec
from lippmann.optics.rig.check import check_job
from lippmann.plan.design.designer import design, drawing
from service.auth import Caller
from service.db.engine import Database
from service.errors import problems_in
from service.jobs.limits import job_demands, limited_spec, owner_demands
from service.jobs.storage_quota import stored_by
from service.jobs.submission import resolve
from service.limits import Limits
from service.schemas.check import AskedLimit, JobCheck
from service.schemas.design import Design
from service.schemas.problem import FieldError
from service.settings import Settings


def design_job(database: Database, body: Any, *, frame: int | None, owner_id: str | None = None) -> Design:
    """Compute the design of a job file at a frame, by default the first.

    Raises
    ------
    SpecError
        If the job is invalid, as in a submission. The error names every field at fault.
    """
    return _design(_sheet(database, body, owner_id), body, frame=frame)


def _design(sheet: ResolvedJob, body: Any, *, frame: int | None = None) -> Design:
    designed = design(sheet, frame=frame)
    return designed.model_copy(update={"warnings": (*current_job(body)[1], *designed.warnings)})


def draw_job(database: Database, body: Any, *, frame: int | None, owner_id: str | None = None) -> str:
    """Draw the optical bench of a job file as SVG.

    Raises
    ------
    SpecError
        If the job is invalid, as in `design_job`.
    """
    return drawing(_sheet(database, body, owner_id), frame=frame)


def check_job_file(database: Database, caller: Caller, body: Any, *, settings: Settings) -> JobCheck:
    """Return what a submission of a job file would be refused for, and its design; no job file raises an error."""
    problems, detail, made = list[FieldProblem](), "", None
    try:
        spec = parse_spec(body)
    except SpecError as error:
        return JobCheck(detail=error.message, errors=_errors(problems_in(error)), design=None, limits=())
    limits = Limits(settings, caller.limits)
    try:
        limited_spec(spec, limits)
    except SpecError as error:
        problems += problems_in(error)
    with database.reading() as session:
        asked = _asked(session, spec, caller, limits)
    try:
        sheet = _sheet(database, body, caller.scope(sharing=settings.sharing))
        if sheet.sheets is None:
            made = _design(sheet, body)
        else:
            check_job(sheet)
    except SpecError as error:
        problems, detail = [*problems, *problems_in(error)], error.message
    return JobCheck(detail=detail, errors=_errors(problems), design=made, limits=asked)


def _asked(session: Session, spec: JobSpec, caller: Caller, limits: Limits) -> tuple[AskedLimit, ...]:
    owner = caller.owner_id
    demands = (*job_demands(spec), *owner_demands(session, owner, frames=len(spec.frame_numbers)))
    values = [(name, float(value)) for name, value, _ in demands] + [("artifacts_mb", stored_by(session, owner))]
    return tuple(
        AskedLimit(
            name=name, used=value, limit=limits[name].value, source=limits[name].source,
            exceeded=value > limits[name].value,
        )
        for name, value in values
    )  # fmt: skip


def _errors(problems: Iterable[FieldProblem]) -> tuple[FieldError, ...]:
    return tuple(FieldError(field=item.field, expected=item.expected, got=item.got) for item in problems)


def _sheet(database: Database, body: Any, owner_id: str | None) -> ResolvedJob:
    spec = parse_spec(body)
    # The connection is returned before the computation, which may take longer than many requests.
    with database.reading() as session:
        return resolve(session, spec, "design", owner_id=owner_id)
