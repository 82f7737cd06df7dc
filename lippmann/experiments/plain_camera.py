"""A perspective camera in the rig frame, with the imaging lens in its way or without; no array."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from lippmann.experiments.frames import LocalJob
from lippmann.job.render_settings import Antialias
from lippmann.job.scene import SCENE_FILE, parse_scene
from lippmann.job.stage import Stage
from lippmann.optics.lens.prescription import ImagingLens
from lippmann.optics.lens.surfaces import Surface
from povtemplates import literals, write
from povtemplates.catalogue import INCLUDE_FOLDER, MANIFEST, scene_folders
from povtemplates.manifest import read_manifest
from worker.engines.povray.command import SYSTEM_INCLUDE, PictureFormat, RenderCommand
from worker.engines.povray.render import render
from worker.sandbox.limits import Limits
from worker.sandbox.log import AttemptLog

TRACE_LEVEL = 24
"""As in a capture: 6 surfaces of the imaging lens, and the scene's own bounces."""


@dataclass(frozen=True)
class PlainCamera:
    """Where it stands; it looks along -z, at a square window."""

    lens: ImagingLens | None
    """In its way."""
    window_mm: float
    window_z_mm: float
    distance_mm: float
    """From the window to the camera."""


@dataclass(frozen=True)
class Shot:
    """One picture: of which scene, and how."""

    scene: str
    """One that comes along."""
    side_px: int
    parameters: Mapping[str, float] = field(default_factory=dict)
    picture_format: PictureFormat = "exr"
    antialias: Antialias | None = None


def take(job: LocalJob, camera: PlainCamera, shot: Shot, *, folder: Path) -> Path:
    """Render a picture into a folder, with the sandbox and the limits of a job; return where it is.

    Raises
    ------
    lippmann.errors.LippmannError
        Whatever an attempt on the farm would fail with.
    """
    (folder / "view.pov").write_text(pov_text(camera, shot), encoding="utf-8")
    bundle = scene_folders()[shot.scene].resolve()
    limits = job.sheet.spec.render
    with AttemptLog(folder / "log.txt") as log:
        outcome = render(
            _command(shot, bundle, job.place.settings.povray),
            task_dir=folder,
            readable=(bundle, INCLUDE_FOLDER.resolve()),
            sandbox=job.place.sandbox,
            limits=Limits(cpu_s=limits.timeout_s, memory_mb=limits.memory_mb),
            timeout_s=limits.timeout_s,
            stall_s=limits.stall_s,
            on_progress=lambda _: None,
            should_stop=lambda: False,
            log=log,
        )
    return outcome.picture


def pov_text(camera: PlainCamera, shot: Shot) -> str:
    """Return the .pov text: see povtemplates/rigs/lens_image.pov.j2."""
    stage = _stage(shot.scene)
    surfaces = camera.lens.surfaces if camera.lens else ()
    places = (stage.location, stage.look_at, stage.up)
    return write.write_lens_image(
        title=f"Scene {shot.scene}, {'behind the imaging lens' if camera.lens else 'by an ordinary camera'}",
        file=SCENE_FILE,
        parameters=[(name, literals.number(value)) for name, value in sorted(shot.parameters.items())],
        trace_level=TRACE_LEVEL,
        surfaces=len(surfaces),
        lens_rows=[_lens_row(surface) for surface in surfaces],
        camera=literals.numbers((camera.window_mm, camera.window_mm, camera.window_z_mm, camera.distance_mm)),
        stage=", ".join((*map(literals.vector, places), literals.number(stage.mm_per_unit))),
    )


def _command(shot: Shot, bundle: Path, povray: str) -> RenderCommand:
    return RenderCommand(
        pov_file="view.pov",
        picture="view.exr" if shot.picture_format == "exr" else "view.png",
        cols=shot.side_px,
        rows=shot.side_px,
        picture_format=shot.picture_format,
        library_paths=(bundle, INCLUDE_FOLDER.resolve(), SYSTEM_INCLUDE),
        antialias=shot.antialias,
        program=povray,
    )


def _lens_row(surface: Surface) -> str:
    radius_mm = 0 if math.isinf(surface.radius_mm) else surface.radius_mm
    return literals.numbers((radius_mm, surface.thickness_mm, surface.index_after, surface.semi_aperture_mm))


def _stage(scene: str) -> Stage:
    return parse_scene(read_manifest((scene_folders()[scene] / MANIFEST).read_bytes())).stage
