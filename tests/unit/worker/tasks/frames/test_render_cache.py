"""What a worker writes for POV-Ray decides the pixels: two jobs for which it differs have different keys."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from copy import deepcopy
from pathlib import Path
from typing import Any, NoReturn

import pytest
from pydantic import ValidationError

from lippmann.errors import LippmannError, Stopped
from lippmann.job.animation.keyframes import put
from lippmann.job.resolved import ResolvedJob
from lippmann.plan.render_cache import RenderSoftware, tile_key
from lippmann.plan.sampling import Tile
from tests.builders import local_place, small_job, stored_job, tiles_of
from worker.engines.povray import engine
from worker.engines.povray.command import RenderCommand, povray_argv
from worker.sandbox.log import AttemptLog
from worker.tasks.attempts.monitor import NullMonitor
from worker.tasks.attempts.workplace import Workplace
from worker.tasks.frames.depth_pass import depth_of_tile
from worker.tasks.frames.render import render_region

FRAME = 4
SOFTWARE = RenderSoftware(engine="povray", engine_version="1", engine_includes="2", templates="3", code="4")

TEXTS: dict[str, list[Any]] = {
    "scene": ["other"],
    "title": ["other"],
    "file": ["other.pov"],
    "bundle": ["c" * 64],
    "frames": ["1-9"],
    "lattice": ["hexagonal"],
    "projection": ["perspective"],
    "aperture": ["circular"],
    "method": ["glass", "ray_camera", 1],
    "imaging_lens": ["tessar", None],
    "antialias": ["off", {"threshold": 0.2}],
    "f_number": [8.0],
    "stop_mm": [3.0],
    "device": [{"pixel_mm": 0.25, "window_px": [16, 16]}],
    "preset": ["fresnel-tech-630"],
    "repeat_frames": [2],
    "clock": [{"first": 3.0}],
    "tiles": [[2, 2], "auto"],
}
"""Other values of fields that are no numbers, by the last part of their path."""

CHANGING = {
    *("bundle", "file", "clock.first", "clock.per_frame", "clock.repeat_frames", "parameters.ripple"),
    *("spec.capture.depth", "spec.capture.supersample", "spec.render.antialias", "spec.rig.imaging_lens"),
    *("spec.rig.camera.projection", "spec.rig.f_number", "spec.rig.lens_array.pitch_mm", "spec.rig.px_per_lens"),
    *("stage.location.0", "stage.look_at.1", "stage.up.2", "stage.mm_per_unit", "stage.reference_mm"),
}
"""Fields that are known to change what POV-Ray reads, whatever the job."""

JOBS: dict[str, dict[str, Any]] = {
    "ray camera": {"capture": {"depth": True}},
    "glass": {"rig": {"dispersion": True}, "render": {"antialias": {}}},
}


def job(name: str) -> dict[str, Any]:
    spec = small_job("fish", count=(4, 4), px_per_lens=4, frames="1-5", **deepcopy(JOBS[name]))
    return spec.model_dump(mode="json")


def leaves(data: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """Yield every value of a job with its path, containers included."""
    if path:
        yield path, data
    items = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    for name, inner in items:
        yield from leaves(inner, f"{path}.{name}".removeprefix("."))


def others(path: str, value: Any) -> list[Any]:
    last = path.rpartition(".")[2]
    if last in TEXTS:
        return TEXTS[last]
    if isinstance(value, bool):
        return [not value]
    return [value + 2 if isinstance(value, int) else value * 1.25 + 0.125] if isinstance(value, int | float) else []


def changed_jobs(sheet: ResolvedJob) -> Iterator[tuple[str, ResolvedJob]]:
    """Yield the job with every one of its fields changed, where such a job is valid."""
    data = sheet.model_dump(mode="json")
    for path, value in leaves(data):
        for other in others(path, value):
            changed = deepcopy(data)
            put(changed, path, other)
            try:
                yield path, ResolvedJob.model_validate(changed)
            except ValidationError:
                continue


class Written(LippmannError):
    """Stop before POV-Ray runs."""


def written(place: Workplace, sheet: ResolvedJob, tile: Tile, monkeypatch: pytest.MonkeyPatch) -> list[Any] | None:
    """Return all that POV-Ray would read for a tile; None if no such picture can be rendered."""
    found: list[Any] = []

    def keep(command: RenderCommand, *, task_dir: Path, readable: list[Path], **_: Any) -> NoReturn:
        argv = [word for word in povray_argv(command) if not word.startswith("+L")]
        found.append((argv, {path.name: path.read_text() for path in task_dir.glob("lippmann-*.*")}, sheet.bundle))
        raise Stopped

    monkeypatch.setattr(engine, "render", keep)
    monkeypatch.setattr(Workplace, "bundle", lambda *_: contextlib.nullcontext(place.settings.data_dir))
    with place.task_folder() as folder, AttemptLog(folder.with_suffix(".txt")) as log:
        more: dict[str, Any] = {"folder": folder, "log": log, "monitor": NullMonitor()}
        try:
            with pytest.raises(Stopped):
                render_region(place, sheet, FRAME, tile, **more)
            if sheet.spec.capture.depth:
                with pytest.raises(Stopped):
                    depth_of_tile(place, sheet, FRAME, tile, **more)
        except (LippmannError, ValueError):
            return None
    return found


@pytest.mark.parametrize("name", JOBS)
def test_a_field_that_changes_what_povray_reads_changes_the_key(
    tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    place = local_place(tmp_path)
    sheet = stored_job(place, small_job("fish", count=(4, 4), px_per_lens=4, frames="1-5", **deepcopy(JOBS[name])))
    tile = tiles_of(sheet.spec)[0]
    was, was_key = (
        written(place, sheet, tile, monkeypatch),
        tile_key(sheet, FRAME, tile, SOFTWARE, reads_clock=True, reads_frames=True),
    )
    assert was is not None
    seen: set[str] = set()
    for path, other in changed_jobs(sheet):
        now = written(place, other, tile, monkeypatch)
        if now is not None and now != was:
            seen.add(path)
            key = tile_key(other, FRAME, tile, SOFTWARE, reads_clock=True, reads_frames=True)
            assert key != was_key, f"{path} changes what POV-Ray reads and not the key"
    assert seen >= CHANGING
