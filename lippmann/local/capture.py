"""One frame without a farm: which scene and which job, then the worker's own steps."""

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
from worker.engines.povray.version import check_povray
from worker.settings import WorkerSettings
from worker.tasks.local import capture_frame

_UNNAMED = "scene"
"""What a job calls a folder whose name is none for a scene."""


@dataclass(frozen=True)
class Captured:
    """What a capture made."""

    files: tuple[Path, ...]
    notes: tuple[str, ...]
    seconds: float


def capture_here(
    scene: str | None, job_file: str | None, overrides: Sequence[str], *, frame: int, out: Path
) -> Captured:
    """Render one frame of a scene, or of a job, into a folder.

    Raises
    ------
    LippmannError
        If neither scene nor job is there, the folder cannot be written, or POV-Ray is missing.
    lippmann.errors.LippmannError
        Whatever an attempt on the farm would fail with.
    """
    spec, bundle = wanted_job(scene, job_file, overrides)
    settings = WorkerSettings()
    check_povray(settings.povray)
    check_writable(out)
    began_s = time.monotonic()
    with ProgressLine(f"frame {frame}") as line:
        captured = capture_frame(
            spec, bundle, frame=frame, out=out, settings=settings, on_progress=lambda step, part: line.show(part, step)
        )
    return Captured(files=captured.pictures, notes=captured.notes, seconds=time.monotonic() - began_s)


def wanted_job(scene: str | None, job_file: str | None, overrides: Sequence[str]) -> tuple[JobSpec, bytes]:
    """Return the job that the options ask for, and its scene's bundle: SCENE goes before the job file's scene."""
    job: dict[str, Any] = read_job(job_file) if job_file else {}
    for override in overrides:
        set_field(job, override)
    take_in_lens(job, Path())
    return job_of(job, scene)


def job_of(job: dict[str, Any], scene: str | None) -> tuple[JobSpec, bytes]:
    """Return a job as it was read, checked, and its scene's bundle: `scene` goes before the job's own."""
    wanted = scene or job.get("scene")
    if not isinstance(wanted, str):
        raise BadInput("expected a SCENE or a job with one in --job, got neither")
    name, bundle = find_bundle(wanted)
    return parse_spec(job | {"scene": _scene_name(name)}), bundle


def _scene_name(name: str) -> str:
    lower = name.lower().replace("_", "-")
    return lower if lower.replace("-", "").isalnum() and lower.isascii() and not lower.startswith("-") else _UNNAMED
