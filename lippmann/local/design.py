"""Design a job without a farm: the job, the stage of its scene, then the numbers."""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from lippmann.errors import BadInput
from lippmann.job.presets import JOBS
from lippmann.job.resolved import ResolvedJob
from lippmann.job.spec import JobSpec
from lippmann.local.capture import job_of
from lippmann.local.files.job import read_job, set_field, take_in_lens
from lippmann.plan.design import designer
from lippmann.plan.design.design import Design
from worker.sandbox.bundle import check_bundle

Job = JobSpec | Mapping[str, Any] | str | Path
"""A job: validated, as the data of a job file, or as the path of a job file."""


def design(
    job: Job | None = None,
    *,
    preset: str | None = None,
    scene: str | None = None,
    overrides: Sequence[str] = (),
    frame: int | None = None,
) -> Design:
    """Compute what a job will give, without rendering: lens, image, views, display, depth budget, cost.

    Parameters
    ----------
    job
        The job; None for the preset, or for a job of defaults.
    preset
        The name of a preset in place of a job, as `paper-still`; see `lippmann.job.presets`.
    scene
        The scene: the name of one that is included, a folder or a zip; None for the scene of the job.
    overrides
        Fields of the job to set, each as `field=value`.
    frame
        The number of the frame; None for the first one.

    Raises
    ------
    BadInput
        If there is no such job or scene, or both a job and a preset are given.
    SpecError
        If the job asks for something that cannot be done.
    """
    return designer.design(design_sheet(job, preset=preset, scene=scene, overrides=overrides), frame=frame)


def design_sheet(job: Job | None, *, preset: str | None, scene: str | None, overrides: Sequence[str]) -> ResolvedJob:
    """Return a job with the stage of its scene, as the designer takes it.

    Parameters
    ----------
    job, preset, scene, overrides
        As in `design`.
    """
    fields = _fields(job, preset, scene)
    for override in overrides:
        set_field(fields, override)
    take_in_lens(fields, Path())
    spec, bundle = job_of(fields, scene)
    checked = check_bundle(bundle)
    return ResolvedJob.of("design", spec, checked.card, bundle=checked.digest)


def _fields(job: Job | None, preset: str | None, scene: str | None) -> dict[str, Any]:
    if job is not None and preset is not None:
        raise BadInput("expected a JOB or a --preset, got both")
    if isinstance(job, JobSpec):
        return job.model_dump(mode="json")
    if isinstance(job, str | Path):
        return read_job(str(job))
    if job is not None:
        return copy.deepcopy(dict(job))
    if preset is None:
        if scene is None:
            raise BadInput(f"expected a JOB, a --scene or a --preset of {', '.join(JOBS)}, got none of them")
        return {}
    if preset not in JOBS:
        raise BadInput(f"--preset: expected one of {', '.join(JOBS)}, got {preset!r}")
    return copy.deepcopy(dict(JOBS[preset]))
