"""Render a region with a warm session: the request, its answer, and its files, of which nothing is believed."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import LippmannError, RenderFailed
from worker.engines.mitsuba.answers import AnswerReader
from worker.engines.mitsuba.diagnosis import Case, diagnose
from worker.engines.mitsuba.inside.messages import FILE_CHANNELS, FileKind, Request, Result
from worker.engines.mitsuba.session import Session
from worker.sandbox.limits import TimeLimits
from worker.sandbox.log import AttemptLog
from worker.sandbox.results import take_result

LARGEST_MOTION_MM = float(np.finfo(np.float32).max)

BOUNDS: Mapping[FileKind, tuple[float, float]] = {
    "normal": (-1.001, 1.001),
    "albedo": (0, 1),
    "motion": (-LARGEST_MOTION_MM, LARGEST_MOTION_MM),
}
"""The least and the greatest number of channels whose numbers are NaN elsewhere."""


@dataclass(frozen=True)
class RenderedRegion:
    """The pixels of a region and the resources that they took."""

    pixels: dict[FileKind, NDArray[np.float32]]
    """`(rows, cols, channels)` of the region by their kind, see `FILE_CHANNELS`; light is finite and not below 0."""
    objects: tuple[str, ...]
    """The names of the shapes from number 1, if the channel `object` was asked for."""
    notes: tuple[str, ...]
    """What the program left out or replaced."""
    load_s: float
    """The time in which the scene was loaded, as the program says; 0 if it was there."""
    trace_s: float
    """The time in which it was traced, as the program says."""
    wall_s: float
    """The time from the request to its answer; the first one of a session has the start of the program in it."""
    cpu_s: float
    """CPU time of the whole sandbox for this request, as the kernel counts it."""
    peak_memory_mb: float
    """Resident memory of the largest process of the session so far."""


def render(
    session: Session,
    request: Request,
    *,
    times: TimeLimits,
    on_progress: Callable[[float], None],
    should_stop: Callable[[], bool],
    log: AttemptLog,
) -> RenderedRegion:
    """Ask a session for a region and return its pixels; after an error, the session is over.

    Raises
    ------
    SceneError
        If Mitsuba refuses the scene.
    Stopped, RenderTimedOut, RenderStalled, RenderCrashed, OutOfMemory, RenderFailed, DiskFull, SandboxMissing
        See the table in `diagnosis`; also RenderFailed if its files are not what was asked for.
    """
    reader = AnswerReader(request.number)
    outcome = session.ask(
        request.line().decode().rstrip("\n"),
        reader,
        times=times,
        on_progress=on_progress,
        should_stop=should_stop,
        log=log,
    )
    try:
        free_bytes = shutil.disk_usage(session.folder).free
        error = diagnose(Case(outcome, reader.answer, session.key.limits, times, free_bytes))
        if error:
            raise error
        assert isinstance(reader.answer, Result)  # noqa: S101 - anything else was an error
        pixels = _take(session, request, reader.answer)
        session.tidy()
    except LippmannError:
        session.close()
        raise
    answer = reader.answer
    for note in answer.notes:
        log.write(note)
    return RenderedRegion(
        pixels=pixels,
        objects=answer.objects,
        notes=answer.notes,
        load_s=min(answer.load_s, outcome.wall_s),
        trace_s=min(answer.trace_s, outcome.wall_s),
        wall_s=outcome.wall_s,
        cpu_s=outcome.cpu_s,
        peak_memory_mb=outcome.peak_memory_mb,
    )


def _take(session: Session, request: Request, result: Result) -> dict[FileKind, NDArray[np.float32]]:
    wanted = {kind: request.file_name(kind) for kind in request.kinds}
    if result.files != wanted:
        raise RenderFailed(f"expected the files {_listed(wanted)} from Mitsuba, got {_listed(result.files)[:300]}")
    return {kind: _numbers(session, request, kind, len(result.objects)) for kind in request.kinds}


def _numbers(session: Session, request: Request, kind: FileKind, objects: int) -> NDArray[np.float32]:
    name, size = request.file_name(kind), request.file_bytes(kind)
    file = take_result(session.work, name, into=session.folder, max_bytes=size)
    if file is None:
        raise RenderFailed(f"expected a file {name} from Mitsuba, got none")
    numbers = _read(file, size)
    light = numbers.reshape(*request.shape, FILE_CHANNELS[kind])
    if kind == "radiance":
        _check_light(light)
    elif kind in BOUNDS or kind == "object":
        _check_channel(kind, light, BOUNDS.get(kind, (0, objects)))
    return light


def _read(file: Path, size: int) -> NDArray[np.float32]:
    try:
        if (got := file.stat().st_size) != size:
            raise RenderFailed(f"expected {size} bytes in {file.name}, got {got}")
        return np.fromfile(file, dtype="<f4")
    finally:
        file.unlink()


def _check_light(light: NDArray[np.float32]) -> None:
    wrong = ~(np.isfinite(light) & (light >= 0)).all(axis=2)
    if wrong.any():
        row, col = map(int, np.argwhere(wrong)[0])
        got = ", ".join(f"{value:g}" for value in light[row, col])
        raise RenderFailed(f"expected finite light of at least 0 from Mitsuba, got {got} at row {row}, column {col}")


def _check_channel(kind: FileKind, values: NDArray[np.float32], bounds: tuple[float, float]) -> None:
    least, most = bounds
    fits = (values >= least) & (values <= most)
    fits &= values == np.floor(values) if kind == "object" else True
    wrong = ~(fits if kind == "object" else fits | np.isnan(values)).all(axis=2)
    if wrong.any():
        row, col = map(int, np.argwhere(wrong)[0])
        got = ", ".join(f"{value:g}" for value in values[row, col])
        whole = "whole numbers" if kind == "object" else "numbers"
        raise RenderFailed(
            f"expected {whole} from {least:g} to {most:g} as {kind} from Mitsuba, got {got} at row {row}, column {col}"
        )


def _listed(files: dict[FileKind, str]) -> str:
    return ", ".join(f"{kind} {name}" for kind, name in files.items()) or "none"
