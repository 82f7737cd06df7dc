"""A design without a farm: which job, its scene's stage, then numbers and drawing."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from lippmann.errors import BadInput
from lippmann.job.presets import JOBS
from lippmann.job.resolved import JobSheet
from lippmann.local.capture import job_of
from lippmann.local.files.job import read_job, set_field, take_in_lens
from lippmann.plan.design.design import Design
from lippmann.plan.design.designer import design, drawing
from worker.sandbox.bundle import check_bundle


@dataclass(frozen=True)
class Designed:
    """What was designed."""

    numbers: Design
    svg: str | None


def design_here(
    job_file: str | None,
    overrides: Sequence[str],
    *,
    preset: str | None,
    scene: str | None,
    frame: int | None,
    with_drawing: bool,
) -> Designed:
    """Return the design of a job from a file or a preset, and its drawing if wanted.

    Raises
    ------
    LippmannError
        If there is no such job or scene.
    lippmann.errors.SpecError
        If it asks for what cannot be.
    """
    job = dict(_chosen(job_file, preset, scene))
    for override in overrides:
        set_field(job, override)
    take_in_lens(job, Path())
    spec, bundle = job_of(job, scene)
    checked = check_bundle(bundle)
    sheet = JobSheet.of("design", spec, checked.card, bundle=checked.digest)
    return Designed(design(sheet, frame=frame), drawing(sheet, frame=frame) if with_drawing else None)


def _chosen(job_file: str | None, preset: str | None, scene: str | None) -> dict[str, Any]:
    if job_file is not None and preset is not None:
        raise BadInput("expected a JOB or a --preset, got both")
    if job_file is not None:
        return read_job(job_file)
    if preset is None:
        if scene is None:
            raise BadInput(f"expected a JOB, a --scene or a --preset of {', '.join(JOBS)}, got neither")
        return {}
    if preset not in JOBS:
        raise BadInput(f"--preset: expected one of {', '.join(JOBS)}, got {preset!r}")
    return copy.deepcopy(dict(JOBS[preset]))
