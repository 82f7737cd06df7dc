"""The limits of the farm and of a key: what a job may ask for, and how much an owner may have at once.

A value above its limit is refused if a job file asks for it. A value that is the default of the format was not asked
for, so it is lowered, and the notes of the job say so.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from sqlalchemy.orm import Session

from lippmann.errors import FieldProblem, SpecError
from lippmann.job.rendering.render_settings import RenderSettings
from lippmann.job.spec import JobSpec
from lippmann.plan.sampling import frame_size
from service.db import jobs as job_rows
from service.errors import QuotaExceeded
from service.jobs.fair_share import Claim
from service.jobs.storage_quota import check_storage
from service.limits import Limits
from service.settings import Settings

RETRY_S = 60.0
"""The time after which a client with too many open jobs may try again; jobs take minutes."""
LIMITED_TIMES = ("timeout_s", "stall_s", "parse_timeout_s", "photons_timeout_s", "probe_timeout_s")


def limited_spec(spec: JobSpec, limits: Limits) -> tuple[JobSpec, tuple[str, ...]]:
    """Return a job within the limits, with a note for every default that was lowered.

    Raises
    ------
    SpecError
        If the job asks for more. The error names every field, the limit and the value.
    """
    lowered: dict[str, float] = {}
    problems = [*_problems_of_size(spec, limits)]
    for field in ("memory_mb", *LIMITED_TIMES):
        limit, value = limits["memory_mb" if field == "memory_mb" else "timeout_s"], getattr(spec.render, field)
        if value <= limit.value:
            continue
        if value == RenderSettings.model_fields[field].default:
            lowered[field] = limit.value
        else:
            problems.append(FieldProblem(field=f"render.{field}", expected=str(limit), got=f"{value:.15g}"))
    if problems:
        raise SpecError.of(problems)
    notes = tuple(
        f"render.{field} is {value:g} and not the default {getattr(spec.render, field):g}, because that is the limit."
        for field, value in lowered.items()
    )
    return spec.model_copy(update={"render": spec.render.model_copy(update=lowered)}), notes


def task_count(spec: JobSpec, *, tile_rows: int, tile_cols: int) -> int:
    """Return the number of tasks of a job whose frames are cut into tiles.

    >>> task_count(JobSpec(scene="fish", frames="1-3"), tile_rows=2, tile_cols=1)
    13
    """
    return 1 + len(spec.frame_numbers) * (tile_rows * tile_cols + 1) + len(spec.outputs)


def claim_of(row: job_rows.ClaimRow, settings: Settings) -> Claim:
    """Return the claim of a job, with the lower one of the limits of slots of the farm and of its key."""
    job_id, priority, outstanding, ready, owner_id, of_key, requirement, own_slots = row
    max_slots = settings.max_slots if of_key is None else min(settings.max_slots, of_key)
    return Claim(job_id, priority, outstanding, ready, owner_id, max_slots, requirement, own_slots)


def check_quota(session: Session, owner_id: str, *, frames: int, limits: Limits) -> None:
    """Refuse one more open job with some frames if its owner has as many as the limits allow.

    Raises
    ------
    QuotaExceeded
        If the owner has too many open jobs, or these have too many frames.
    StorageQuotaExceeded
        If the artifacts of the owner are too large.
    """
    check_storage(session, owner_id, limits=limits)
    for demand in owner_demands(session, owner_id, frames=frames):
        limit = limits[demand.name]
        if demand.value > limit.value:
            asked = f"would have {demand.value} {demand.words}"
            message = f"{owner_id!r} {asked}, expected {limit}; wait until jobs end, or cancel some"
            raise QuotaExceeded(message, retry_after_s=RETRY_S)


class Demand(NamedTuple):
    """The share of a limit that a job asks for."""

    name: str
    """The name of the limit."""
    value: int
    words: str
    """The fields of the job that determine it, or what is counted."""


def job_demands(spec: JobSpec) -> tuple[Demand, ...]:
    """Return how much of the limits of one job a job asks for."""
    size, frames = frame_size(spec.rig), len(spec.frame_numbers)
    frame_px = size.px * spec.rays_per_px * spec.render.samples
    rows, cols = (1, 1) if spec.render.tiles == "auto" else spec.render.tiles
    return (
        Demand("frames", frames, "frames"),
        Demand("frame_px", frame_px, _size_fields(spec)),
        Demand("job_px", frames * frame_px, "frames x pixels of a frame"),
        Demand("tasks", task_count(spec, tile_rows=rows, tile_cols=cols), "frames x render.tiles"),
    )


def owner_demands(session: Session, owner_id: str, *, frames: int) -> tuple[Demand, ...]:
    """Return how much an owner would have of the limits of all jobs with one more job of some frames."""
    jobs, open_frames = job_rows.open_of(session, owner_id)
    return (
        Demand("open_jobs", jobs + 1, "open jobs"),
        Demand("open_frames", open_frames + frames, "frames in open jobs"),
    )


def _problems_of_size(spec: JobSpec, limits: Limits) -> Iterator[FieldProblem]:
    for name, value, fields in job_demands(spec):
        if value > limits[name].value:
            yield FieldProblem(field=fields, expected=str(limits[name]), got=str(value))


def _size_fields(spec: JobSpec) -> str:
    fields = ["rig.lens_array.count", "rig.px_per_lens", "capture.supersample"]
    if spec.rays_per_px > spec.capture.supersample**2:
        fields.append("capture.bands")
    if spec.render.samples > 1:
        fields.append("render.samples")
    return " x ".join(fields)
