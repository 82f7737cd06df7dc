"""Fig. 5: the scene through an ordinary camera, and its image behind the imaging lens, without the array.

The ordinary camera stands in the front focal point of the imaging lens, through which all rays pass that leave the lens
parallel to the axis, and its window is that of the array in the scene's reference plane. The camera behind the lens is
the pinhole camera of the paper, which looks at the real image; its window is in the paraxial image of the reference
plane.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.experiments import settings
from lippmann.experiments.frames import LocalJob, prepared
from lippmann.experiments.panels import Panel, fitted, write_panels
from lippmann.experiments.plain_camera import Picture, PlainCamera, render_picture
from lippmann.experiments.request import FigureRequest, FigureResult
from lippmann.job.optics.rig import PAPER_CAMERA_ANGLE_DEG
from lippmann.job.rendering.render_settings import Antialias
from lippmann.optics.lens.matrices import Conjugate, cardinal_points, conjugate
from lippmann.optics.lens.prescription import ImagingLens, rig_lens
from worker.engines.povray.pictures.pixels import read_codes
from worker.images.read import read_rgb
from worker.images.write import write_png

SIDE_PX, QUICK_PX = 720, 120
SHOWN_PX = 640
SMOOTH = Antialias(threshold=0.05, method=2, depth=2)
CODED_PX, CODED_HALF_WIDTH_MM = 200, 400.0
"""The target codes x from -400 to 400 mm with 16 bits, so that one step is 0.012 mm."""
NEAR_AXIS = 0.1
"""The fraction of the window in which the magnification is measured, so that distortion does not count."""

Light = NDArray[np.float32]
Places = NDArray[np.float64]


def fig5(request: FigureRequest) -> FigureResult:
    """Render both pictures, and measure the orientation and the magnification of the image."""
    picture = Picture("fish", QUICK_PX if request.quick else SIDE_PX, antialias=SMOOTH)
    with prepared(settings.still(lattice="square", quick=False), request) as job:
        lens, reference_mm = rig_lens(job.sheet.spec.rig), job.sheet.stage.reference_mm
        assert lens is not None  # noqa: S101 - the paper's job has one
        ordinary, behind = ordinary_camera(lens, reference_mm), image_camera(lens, reference_mm)
        request.report(0.1, "the scene")
        scene = _picture(job, ordinary, picture)
        request.report(0.4, "its image")
        image = _picture(job, behind, picture)
        request.report(0.9, "its magnification")
        measured = likeness(scene, image) | image_size(*_measured_points_mm(job, behind))
    paraxial = conjugate(lens, reference_mm)
    measured |= {"magnification_paraxial": paraxial.magnification, "image_behind_the_lens_mm": paraxial.image_mm}
    files = (request.file(".png"), request.file("a.png"), request.file("b.png"))
    write_panels(files[0], [_panels(scene, image, ordinary, behind, paraxial)])
    for file, light in zip(files[1:], (scene, image), strict=True):
        write_png(file, light)
    picture_settings = {
        "scene": picture.scene,
        "side_px": picture.side_px,
        "antialias": SMOOTH.model_dump(),
        "camera_deg": PAPER_CAMERA_ANGLE_DEG,
    }
    return FigureResult(files=files, settings=picture_settings, measured=measured, text=_text(measured))


def ordinary_camera(lens: ImagingLens, reference_mm: float) -> PlainCamera:
    """Return the camera that sees the scene as the central view of the capture does."""
    focus_mm = cardinal_points(lens).front_focal_distance_mm
    window_mm = settings.ARRAY_MM / abs(conjugate(lens, reference_mm).magnification)
    return PlainCamera(None, window_mm, -reference_mm, focus_mm + reference_mm)


def image_camera(lens: ImagingLens, reference_mm: float) -> PlainCamera:
    """Return the camera of the paper, behind the imaging lens."""
    window_z_mm = lens.length_mm + conjugate(lens, reference_mm).image_mm
    distance_mm = settings.ARRAY_MM / (2 * math.tan(math.radians(PAPER_CAMERA_ANGLE_DEG) / 2))
    return PlainCamera(lens, settings.ARRAY_MM, window_z_mm, distance_mm)


def likeness(scene: Light, image: Light) -> dict[str, Any]:
    """Return the flip of the image that correlates best with the scene, and the correlations of all flips."""
    seen, found = scene.mean(axis=-1).ravel(), image.mean(axis=-1)
    flips = {
        "upright": found,
        "mirrored": found[:, ::-1],
        "upside down": found[::-1],
        "turned by 180 degrees": found[::-1, ::-1],
    }
    alike = {name: float(np.corrcoef(seen, flip.ravel())[0, 1]) for name, flip in flips.items()}
    return {"orientation": max(alike, key=lambda name: alike[name]), "likeness": alike}


def _picture(job: LocalJob, camera: PlainCamera, picture: Picture) -> Light:
    with job.place.task_folder() as folder:
        return read_rgb(render_picture(job, camera, picture, folder=folder), np.float32)


def image_size(window_mm: Places, seen_mm: Places) -> dict[str, float]:
    """Return the magnification of an image near the axis, and its relative change at the edge.

    Parameters
    ----------
    window_mm, seen_mm
        Points along a line through the centre of the window, and the points of the object plane that they show, mm.
    """
    near = np.abs(window_mm) < NEAR_AXIS * 2 * np.abs(window_mm).max()
    magnification = float(1 / np.polyfit(window_mm[near], seen_mm[near], 1)[0])
    edge = float((window_mm[-1] - window_mm[0]) / (seen_mm[-1] - seen_mm[0]))
    return {"magnification": magnification, "distortion_at_the_edge": edge / magnification - 1}


def _measured_points_mm(job: LocalJob, camera: PlainCamera) -> tuple[Places, Places]:
    """Return x in the window and the x of the reference plane that it shows, from a plane whose colour codes x, mm."""
    parameters = {"half_width_mm": CODED_HALF_WIDTH_MM}
    picture = Picture("target-position", CODED_PX, parameters=parameters, picture_format="ppm16")
    with job.place.task_folder() as folder:
        codes = read_codes(render_picture(job, camera, picture, folder=folder))
    x_mm = codes[CODED_PX // 2, :, 0] / 65535 * 2 * CODED_HALF_WIDTH_MM - CODED_HALF_WIDTH_MM
    window_mm = ((np.arange(CODED_PX) + 0.5) / CODED_PX - 0.5) * camera.window_mm
    return window_mm, x_mm


def _panels(scene: Light, image: Light, ordinary: PlainCamera, behind: PlainCamera, paraxial: Conjugate) -> list[Panel]:
    where = f"window {behind.window_mm:.0f} mm, {paraxial.image_mm:.0f} mm behind the lens"
    captions = (
        f"(a) the scene through an ordinary camera\nwindow {ordinary.window_mm:.0f} mm",
        f"(b) its real image behind the imaging lens\n{where}",
    )
    return [
        Panel(fitted(picture, SHOWN_PX), caption) for picture, caption in zip((scene, image), captions, strict=True)
    ]


def _text(measured: Mapping[str, Any]) -> str:
    alike = ", ".join(f"{name} {value:.2f}" for name, value in measured["likeness"].items())
    return (
        f"the image is {measured['orientation']} (correlation with the scene of each flip: {alike})\n"
        f"magnification near the axis {measured['magnification']:.4f}, paraxial"
        f" {measured['magnification_paraxial']:.4f}; distortion at the edge {measured['distortion_at_the_edge']:+.1%}"
    )
