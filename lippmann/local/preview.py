"""Previews without a farm: small pictures of a job within seconds, once or whenever its files change."""

from __future__ import annotations

import time
from base64 import b64decode
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from lippmann.errors import BadInput, LippmannError
from lippmann.local.capture import requested_job
from lippmann.local.files.writable import check_writable
from lippmann.plan.preview import PreviewRig, PreviewSize, PreviewTimes
from worker.engines.choose import ENGINES
from worker.sandbox.bundle import check_bundle
from worker.settings import WorkerSettings
from worker.tasks.previews.local import LocalPreviews, local_previews

WATCH_S = 0.1
"""The interval at which files are looked at."""


@dataclass(frozen=True)
class PreviewRequest:
    """A request for previews.

    Parameters
    ----------
    scene, job_file, overrides
        As in `lippmann.local.capture.capture`.
    frame
        The number of the frame; None for the first one of the job.
    size
        The largest size of the preview.
    out
        The folder to write.
    """

    scene: str | None
    job_file: str | None
    overrides: Sequence[str]
    frame: int | None
    size: PreviewSize
    out: Path


@dataclass(frozen=True)
class WrittenPreview:
    """The files of a preview, and what it cost."""

    integral: Path
    """The orthoscopic integral image."""
    view: Path
    """The view in the middle."""
    rig: PreviewRig
    notes: tuple[str, ...]
    times: PreviewTimes
    seconds: float
    """The time of all of it."""


def write_preview(request: PreviewRequest) -> WrittenPreview:
    """Render a small frame of a scene, or of a job, and write integral.png and view.png into a folder.

    Raises
    ------
    LippmannError
        If there is neither a scene nor a job, the folder cannot be written, its engine is missing, or the render fails.
    """
    check_writable(request.out)
    with local_previews(WorkerSettings()) as previews:
        return _written(previews, request)


def watch_previews(request: PreviewRequest, on_error: Callable[[LippmannError], None]) -> Iterator[WrittenPreview]:
    """Yield a preview now and whenever the job file or a file of the scene has changed; see `write_preview`.

    Parameters
    ----------
    request
        The request, whose job file or scene is watched.
    on_error
        Receives the error of a preview that failed; a file may have been half written.

    Raises
    ------
    BadInput
        If there is no file to watch, or the folder cannot be written.
    """
    places = [
        Path(name) for name in (request.job_file, request.scene) if name not in (None, "-") and Path(name).exists()
    ]
    if not places:
        raise BadInput("expected a job file in --job or the folder of a scene to watch, got neither")
    check_writable(request.out)
    with local_previews(WorkerSettings()) as previews:
        while True:
            before = _stamp(places)
            try:
                yield _written(previews, request)
            except LippmannError as error:
                on_error(error)
            while _stamp(places) == before:
                time.sleep(WATCH_S)


def _written(previews: LocalPreviews, request: PreviewRequest) -> WrittenPreview:
    began_s = time.monotonic()
    spec, bundle = requested_job(request.scene, request.job_file, request.overrides)
    ENGINES[check_bundle(bundle).card.engine].check_installed(WorkerSettings().povray)
    found = previews.render(spec, bundle, frame=request.frame, size=request.size)
    files = (request.out / "integral.png", request.out / "view.png")
    for path, png in zip(files, (found.made.integral_png, found.made.view_png), strict=True):
        beside = path.with_suffix(".part")
        beside.write_bytes(b64decode(png))
        beside.replace(path)
    return WrittenPreview(
        integral=files[0],
        view=files[1],
        rig=found.rig,
        notes=(*found.notes, *found.made.notes),
        times=PreviewTimes.model_validate(found.made, from_attributes=True),
        seconds=time.monotonic() - began_s,
    )


def _stamp(places: Sequence[Path]) -> dict[str, int]:
    """Return the files of some places with the times at which they changed."""
    files = (file for place in places for file in (place, *(place.rglob("*") if place.is_dir() else ())))
    stamps = {}
    for file in files:
        try:
            stamps[str(file)] = file.stat().st_mtime_ns
        except OSError:  # an editor replaces it just now
            stamps[str(file)] = 0
    return stamps
