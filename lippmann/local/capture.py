"""Capture one frame without a farm: the job and its scene, then the steps of a worker."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from lippmann.errors import BadInput
from lippmann.job.spec import JobSpec, parse_spec
from lippmann.local.files.bundle import find_bundle
from lippmann.local.files.job import read_job, set_field, take_in_lens
from lippmann.local.files.writable import check_writable
from lippmann.terminal.progress import ProgressLine
from worker.engines.choose import ENGINES
from worker.sandbox.bundle import check_bundle
from worker.settings import WorkerSettings
from worker.tasks.local import capture_frame

_UNNAMED = "scene"
"""The scene's name in a job whose folder has a name that is not allowed."""


@dataclass(frozen=True)
class CaptureResult:
    """The files of a capture."""

    files: tuple[Path, ...]
    notes: tuple[str, ...]
    seconds: float


def capture(
    scene: str | None, job_file: str | None, overrides: Sequence[str], *, frame: int, out: Path
) -> CaptureResult:
    """Render one frame of a scene, or of a job, into a folder.

    Parameters
    ----------
    scene
        The scene: the name of one that is included, a folder or a zip; None for the scene of the job.
    job_file
        The job file; None for a job of defaults.
    overrides
        Fields of the job to set, each as `field=value`.
    frame
        The number of the frame.
    out
        The folder to write.

    Raises
    ------
    LippmannError
        If there is neither a scene nor a job, the folder cannot be written, its engine is missing, or the render fails.
    """
    spec, bundle = requested_job(scene, job_file, overrides)
    settings = WorkerSettings()
    ENGINES[check_bundle(bundle).card.engine].check_installed(settings.povray)
    check_writable(out)
    began_s = time.monotonic()
    with ProgressLine(f"frame {frame}") as line:
        captured = capture_frame(
            spec, bundle, frame=frame, out=out, settings=settings, on_progress=lambda step, part: line.show(part, step)
        )
    return CaptureResult(files=captured.pictures, notes=captured.notes, seconds=time.monotonic() - began_s)


def requested_job(scene: str | None, job_file: str | None, overrides: Sequence[str]) -> tuple[JobSpec, bytes]:
    """Return the job that the options request, and the bundle of its scene; `scene` overrides that of the job file.

    Parameters
    ----------
    scene, job_file, overrides
        As in `capture`.
    """
    job: dict[str, Any] = read_job(job_file) if job_file else {}
    for override in overrides:
        set_field(job, override)
    take_in_lens(job, Path())
    return job_of(job, scene)


def job_of(job: dict[str, Any], scene: str | None) -> tuple[JobSpec, bytes]:
    """Validate a job as it was read, and return it with the bundle of its scene; `scene` overrides the job's own.

    Parameters
    ----------
    job
        The data of a job file.
    scene
        The scene, as in `capture`.
    """
    wanted = scene or job.get("scene")
    if not isinstance(wanted, str):
        raise BadInput("expected a SCENE or a job with one in --job, got neither")
    name, bundle = find_bundle(wanted)
    return parse_spec(job | {"scene": _scene_name(name)}), bundle


def _scene_name(name: str) -> str:
    lower = name.lower().replace("_", "-")
    return lower if lower.replace("-", "").isalnum() and lower.isascii() and not lower.startswith("-") else _UNNAMED
