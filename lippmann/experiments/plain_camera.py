"""A perspective camera in the rig frame, with or without the imaging lens, and without the array."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from lippmann.experiments.frames import LocalJob
from lippmann.job.rendering.render_settings import Antialias
from lippmann.job.scenes.scene import SCENE_FILE, parse_scene
from lippmann.job.scenes.stage import Stage
from lippmann.optics.lens.prescription import ImagingLens
from lippmann.optics.lens.surfaces import Surface
from lippmann.untrusted.toml_text import read_toml
from povtemplates import literals, write
from povtemplates.catalogue import INCLUDE_FOLDER, MANIFEST, scene_folders
from worker.engines.povray.command import SUFFIXES, SYSTEM_INCLUDE, PictureFormat, RenderCommand
from worker.engines.povray.render import render
from worker.sandbox.limits import Limits
from worker.sandbox.log import AttemptLog
from worker.tasks.frames.picture import time_limits

TRACE_LEVEL = 24
"""The recursion limit of a capture: 6 surfaces of the imaging lens, and the reflections of the scene."""


@dataclass(frozen=True)
class PlainCamera:
    """A camera that looks along -z at a square window."""

    lens: ImagingLens | None
    """The lens in front of the camera, if there is one."""
    window_mm: float
    window_z_mm: float
    distance_mm: float
    """The distance from the window to the camera, mm."""


@dataclass(frozen=True)
class Picture:
    """A picture to render: its scene and settings."""

    scene: str
    """The name of a built-in scene."""
    side_px: int
    parameters: Mapping[str, float] = field(default_factory=dict)
    picture_format: PictureFormat = "exr"
    antialias: Antialias | None = None


def render_picture(job: LocalJob, camera: PlainCamera, picture: Picture, *, folder: Path) -> Path:
    """Render a picture into a folder, with the sandbox and the limits of a job; return its path.

    Raises
    ------
    lippmann.errors.LippmannError
        If the picture cannot be rendered.
    """
    (folder / "view.pov").write_text(pov_text(camera, picture), encoding="utf-8")
    bundle = scene_folders()[picture.scene].resolve()
    limits = job.sheet.spec.render
    with AttemptLog(folder / "log.txt") as log:
        outcome = render(
            _command(picture, bundle, job.place.settings.povray),
            task_dir=folder,
            readable=(bundle, INCLUDE_FOLDER.resolve()),
            sandbox=job.place.sandbox_for(job.sheet.bundle),
            limits=Limits(cpu_s=limits.timeout_s, memory_mb=limits.memory_mb),
            times=time_limits(limits, job.place.settings, is_probe=False),
            on_progress=lambda _: None,
            should_stop=lambda: False,
            log=log,
        )
    return outcome.picture


def pov_text(camera: PlainCamera, picture: Picture) -> str:
    """Return the .pov text; see povtemplates/rigs/lens_image.pov.j2."""
    stage = _stage(picture.scene)
    surfaces = camera.lens.surfaces if camera.lens else ()
    places = (stage.location, stage.look_at, stage.up)
    return write.write_lens_image(
        title=f"Scene {picture.scene}, {'behind the imaging lens' if camera.lens else 'through an ordinary camera'}",
        file=SCENE_FILE,
        parameters=[(name, literals.number(value)) for name, value in sorted(picture.parameters.items())],
        trace_level=TRACE_LEVEL,
        surfaces=len(surfaces),
        lens_rows=[_lens_row(surface) for surface in surfaces],
        camera=literals.numbers((camera.window_mm, camera.window_mm, camera.window_z_mm, camera.distance_mm)),
        stage=", ".join((*map(literals.vector, places), literals.number(stage.mm_per_unit))),
    )


def _command(picture: Picture, bundle: Path, povray: str) -> RenderCommand:
    return RenderCommand(
        pov_file="view.pov",
        picture=f"view{SUFFIXES[picture.picture_format]}",
        cols=picture.side_px,
        rows=picture.side_px,
        picture_format=picture.picture_format,
        library_paths=(bundle, INCLUDE_FOLDER.resolve(), SYSTEM_INCLUDE),
        antialias=picture.antialias,
        program=povray,
    )


def _lens_row(surface: Surface) -> str:
    radius_mm = 0 if math.isinf(surface.radius_mm) else surface.radius_mm
    return literals.numbers((radius_mm, surface.thickness_mm, surface.index_after, surface.semi_aperture_mm))


def _stage(scene: str) -> Stage:
    return parse_scene(read_toml((scene_folders()[scene] / MANIFEST).read_bytes(), field=MANIFEST)).stage
