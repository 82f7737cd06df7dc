"""Fig. 5: the scene by an ordinary camera, and its image behind the imaging lens, without the array.

The ordinary camera stands in the front focal point of the imaging lens, through which all rays go that leave it
parallel to the axis, and its window is that of the array in the scene's reference plane. The camera behind the lens is
the paper's, of 6.738 degrees, looking at the real image; its window lies in the paraxial image of the reference plane.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.paper import settings
from lippmann.paper.frames import LocalJob, prepared
from lippmann.paper.panels import Panel, fitted, write_panels
from lippmann.paper.request import Made, Request
from povtemplates import literals, write
from povtemplates.catalogue import INCLUDE_FOLDER, scene_folders
from worker.images.read import read_codes, read_rgb
from worker.images.write import write_png
from worker.job.rig import PAPER_CAMERA_ANGLE_DEG
from worker.job.scene import Stage, parse_scene
from worker.job.spec import Antialias
from worker.optics.matrices import cardinal_points, conjugate
from worker.optics.prescription import ImagingLens, rig_lens
from worker.povray.command import SYSTEM_INCLUDE, PictureFormat, RenderCommand
from worker.povray.limits import Limits
from worker.povray.log import AttemptLog
from worker.povray.render import render

SIDE_PX, QUICK_PX = 720, 120
SHOWN_PX = 640
SMOOTH = Antialias(threshold=0.05, method=2, depth=2)
TRACE_LEVEL = 24
CODED_HALF_WIDTH_MM = 400.0
NEAR_AXIS = 0.1
"""Of the window: where the magnification is taken, so that distortion does not count."""


@dataclass(frozen=True)
class View:
    """A perspective camera in the rig frame, looking along -z."""

    lens: ImagingLens | None
    """In its way."""
    window_mm: float
    window_z_mm: float
    distance_mm: float
    """From the window to the camera."""


def fig5(request: Request) -> Made:
    """Render both pictures, and measure how the image lies and how small it is."""
    spec, side = settings.still(lattice="square", quick=False), QUICK_PX if request.quick else SIDE_PX
    with prepared(spec, request) as job:
        lens, stage = rig_lens(spec.rig), job.sheet.stage
        assert lens is not None  # noqa: S101 - the paper's job has one
        before, behind = ordinary_view(lens, stage), image_view(lens, stage)
        request.tell(0.1, "the scene")
        scene = _picture(job, "fish", before, side)
        request.tell(0.4, "its image")
        image = _picture(job, "fish", behind, side)
        request.tell(0.9, "its magnification")
        measured = _alike(scene, image) | {"magnification": _magnification(job, behind)}
    paraxial = conjugate(lens, stage.reference_mm)
    measured |= {"magnification_paraxial": paraxial.magnification, "image_behind_the_lens_mm": paraxial.image_mm}
    files = (request.file(".png"), request.file("a.png"), request.file("b.png"))
    words = f"(b) its real image behind the imaging lens\nwindow {behind.window_mm:.0f} mm, {paraxial.image_mm:.0f} mm behind the lens"
    write_panels(
        files[0],
        [
            [
                Panel(
                    fitted(scene, SHOWN_PX), f"(a) the scene by an ordinary camera\nwindow {before.window_mm:.0f} mm"
                ),
                Panel(fitted(image, SHOWN_PX), words),
            ]
        ],
    )
    for file, picture in zip(files[1:], (scene, image), strict=True):
        write_png(file, picture)
    shown = {"side_px": side, "antialias": SMOOTH.model_dump(), "scene": "fish", "camera_deg": PAPER_CAMERA_ANGLE_DEG}
    return Made(files=files, settings=shown, measured=measured, text=_text(measured))


def ordinary_view(lens: ImagingLens, stage: Stage) -> View:
    """Return the camera that sees the scene as the capture's centre view does."""
    focus_mm = cardinal_points(lens).front_focal_distance_mm
    window_mm = settings.ARRAY_MM / abs(conjugate(lens, stage.reference_mm).magnification)
    return View(None, window_mm, -stage.reference_mm, focus_mm + stage.reference_mm)


def image_view(lens: ImagingLens, stage: Stage) -> View:
    """Return the paper's camera behind the imaging lens."""
    window_z_mm = lens.length_mm + conjugate(lens, stage.reference_mm).image_mm
    distance_mm = settings.ARRAY_MM / (2 * math.tan(math.radians(PAPER_CAMERA_ANGLE_DEG) / 2))
    return View(lens, settings.ARRAY_MM, window_z_mm, distance_mm)


def _text(measured: Mapping[str, Any]) -> str:
    likeness = ", ".join(f"{name} {value:.2f}" for name, value in measured["likeness"].items())
    return (
        f"the image is {measured['orientation']} (correlation with the scene: {likeness})\n"
        f"magnification near the axis {measured['magnification']:.4f}, by small angles"
        f" {measured['magnification_paraxial']:.4f}"
    )


def _picture(job: LocalJob, scene: str, view: View, side: int) -> NDArray[np.float32]:
    with job.place.task_folder() as folder:
        return read_rgb(_render(job, scene, view, side, folder, {}, "exr", SMOOTH), np.float32)


def _alike(scene: NDArray[np.float32], image: NDArray[np.float32]) -> dict[str, Any]:
    """Return how much the image is like the scene as it is, and like its flips."""
    seen, flips = scene.mean(axis=-1).ravel(), image.mean(axis=-1)
    turned = {
        "upright": flips,
        "mirrored": flips[:, ::-1],
        "upside down": flips[::-1],
        "upside down and mirrored": flips[::-1, ::-1],
    }
    likeness = {name: float(np.corrcoef(seen, flip.ravel())[0, 1]) for name, flip in turned.items()}
    return {"orientation": max(likeness, key=lambda name: likeness[name]), "likeness": likeness}


def _magnification(job: LocalJob, view: View) -> float:
    """Return how large the image of the reference plane is, from a plane whose colour codes the place that was hit."""
    side, coded = 200, {"half_width_mm": CODED_HALF_WIDTH_MM}
    with job.place.task_folder() as folder:
        codes = read_codes(_render(job, "target-position", view, side, folder, coded, "png16", None))
    x_mm = codes[side // 2, :, 0] / 65535 * 2 * CODED_HALF_WIDTH_MM - CODED_HALF_WIDTH_MM
    window_mm = ((np.arange(side) + 0.5) / side - 0.5) * view.window_mm
    near = np.abs(window_mm) < NEAR_AXIS * view.window_mm
    return float(1 / np.polyfit(window_mm[near], x_mm[near], 1)[0])


def _render(
    job: LocalJob,
    scene: str,
    view: View,
    side: int,
    folder: Path,
    parameters: Mapping[str, float],
    picture_format: PictureFormat,
    antialias: Antialias | None,
) -> Path:
    bundle = scene_folders()[scene].resolve()
    (folder / "view.pov").write_text(_text_of(scene, view, parameters), encoding="utf-8")
    command = RenderCommand(
        pov_file="view.pov",
        picture="view.exr" if picture_format == "exr" else "view.png",
        cols=side,
        rows=side,
        picture_format=picture_format,
        library_paths=(bundle, INCLUDE_FOLDER.resolve(), SYSTEM_INCLUDE),
        antialias=antialias,
        program=job.place.settings.povray,
    )
    limits = job.sheet.spec.render
    with AttemptLog(folder / "log.txt") as log:
        outcome = render(
            command,
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


def _text_of(scene: str, view: View, parameters: Mapping[str, float]) -> str:
    stage = _stage_of(scene)
    surfaces = view.lens.surfaces if view.lens else ()
    return write.write_lens_image(
        title=f"Scene {scene}, {'behind the imaging lens' if view.lens else 'by an ordinary camera'}",
        file="scene.inc",
        parameters=[(name, literals.number(value)) for name, value in sorted(parameters.items())],
        trace_level=TRACE_LEVEL,
        surfaces=len(surfaces),
        lens_rows=[
            literals.numbers((0 if math.isinf(s.radius_mm) else s.radius_mm, s.thickness_mm, s.index_after,
                              s.semi_aperture_mm))
            for s in surfaces
        ],
        camera=literals.numbers((view.window_mm, view.window_mm, view.window_z_mm, view.distance_mm)),
        stage=", ".join(
            (*map(literals.vector, (stage.location, stage.look_at, stage.up)), literals.number(stage.mm_per_unit))
        ),
    )  # fmt: skip


def _stage_of(scene: str) -> Stage:
    from povtemplates.catalogue import MANIFEST
    from povtemplates.manifest import read_manifest

    return parse_scene(read_manifest((scene_folders()[scene] / MANIFEST).read_bytes())).stage
