"""A job file becomes the job of a preview, by the rules of a submission."""

from __future__ import annotations

from typing import Any, NamedTuple

from lippmann.job.fields.old_names import current_job
from lippmann.job.resolved import ResolvedJob
from lippmann.job.spec import parse_spec
from lippmann.optics.rig.check import check_rig
from lippmann.plan.preview import PreviewSize, preview_job
from service.auth import Caller
from service.db import coordinator as coordinator_rows
from service.db.engine import Database
from service.jobs.limits import limited_spec
from service.jobs.submission import resolve
from service.limits import Limits
from service.settings import Settings


class Prepared(NamedTuple):
    """The job of a preview."""

    scene: str
    job: ResolvedJob
    """The job at the frame, with the smaller rig."""
    frame: int
    notes: tuple[str, ...]
    store_id: str | None


def prepare(
    database: Database, caller: Caller, body: Any, *, frame: int | None, size: PreviewSize, settings: Settings
) -> Prepared:
    """Return the job of a preview of a job file, by default at its first frame.

    Raises
    ------
    SpecError
        If the job is invalid, as in a submission, or renders nothing. The error names every field at fault.
    """
    spec, _ = limited_spec(parse_spec(body), Limits(settings, caller.limits))
    with database.reading() as session:
        sheet = resolve(session, spec, "preview", owner_id=caller.scope(sharing=settings.sharing))
        store_id = coordinator_rows.store_id(session)
    number = frame or spec.frame_numbers[0]
    if sheet.sheets is None:
        there = sheet.at(number)
        check_rig(there.spec, there.stage)
    smaller = preview_job(sheet, frame=number, size=size, owner=caller.owner_id)
    return Prepared(spec.scene, smaller.job, number, (*current_job(body)[1], *smaller.notes), store_id)
