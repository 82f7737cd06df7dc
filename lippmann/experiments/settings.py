"""The jobs of the paper with the settings of its sections 4.1 and 4.2, and small versions of them.

A small version has fewer lenses and fewer pixels under each, but the same window and scene: pitch and focal length
grow together, so that the elemental images look alike.

The camera is orthographic, or the pinhole camera of the paper: POV-Ray's perspective camera with a tenth of its
default angle, 6.738 degrees.
"""

from __future__ import annotations

from typing import Any, Literal

from lippmann.experiments.request import CameraModel
from lippmann.job.presets import JOBS
from lippmann.job.spec import JobSpec, parse_spec

ARRAY_MM = 100.0
"""The width of the array of the stills, mm: 100 lenses of 1 mm."""

FOCAL_LENGTHS_A_PITCH = 3.3
"""The focal length of item 630 in pitches, which is its f-number."""

POSITIONS_MM = (60, 40, 10, -10)
"""The positions of the array in Fig. 7 (a) to (d), mm from the image of the central plane of the fish, positive toward
the imaging lens."""

_SWEEP = {"keyframes": [[frame, offset] for frame, offset in enumerate(POSITIONS_MM, start=1)]}

_STANDS_STILL = {"first": 0.0, "per_frame": 0.0}


def still(*, lattice: Literal["square", "hexagonal"], quick: bool, camera: CameraModel = "orthographic") -> JobSpec:
    """Return a still of 100 x 100 lenses of 24 px for 600 dpi, or if `quick`, of 25 x 25 lenses of 8 px."""
    array: dict[str, Any] = {**_array("paper-still"), "lattice": lattice}
    if quick:
        return _job("paper-still", {"lens_array": array | coarse(25), "px_per_lens": 8}, camera)
    return _job("paper-still", {"lens_array": array, "device": JOBS["paper-still"]["rig"]["device"]}, camera)


def sweep(*, px_per_lens: int | None, camera: CameraModel = "orthographic") -> JobSpec:
    """Return the four positions of Fig. 7 as one job of four frames, in which nothing but the array moves.

    Parameters
    ----------
    px_per_lens
        The pixels across a lens, without a device. None means 24, and 2400 x 2400 px at 600 dpi as well.
    camera
        The camera behind the array.
    """
    rig: dict[str, Any] = {"lens_array": {**_array("paper-still"), "offset_mm": _SWEEP}}
    if px_per_lens is None:
        rig["device"] = JOBS["paper-still"]["rig"]["device"]
    else:
        rig["px_per_lens"] = px_per_lens
    return _job("paper-still", rig, camera, frames="1-4", clock=_STANDS_STILL)


def pixels_per_lens(px_per_lens: int, *, quick: bool, camera: CameraModel = "orthographic") -> JobSpec:
    """Return a job of Fig. 8: 100 x 100 lenses of any number of pixels, or if `quick`, 20 x 20 lenses."""
    array = _array("paper-still") | (coarse(20) if quick else {})
    return _job("paper-still", {"lens_array": array, "px_per_lens": px_per_lens}, camera)


def video(*, frames: str, quick: bool, antialias: Any = "off", camera: CameraModel = "orthographic") -> JobSpec:
    """Return the integral video: 90 x 90 lenses of 8 px, or if `quick`, 15 x 15 lenses."""
    array = _array("paper-iv") | (coarse(15) if quick else {})
    rig = {"lens_array": array, "px_per_lens": 8}
    return _job("paper-iv", rig, camera, frames=frames, render={"antialias": antialias})


def coarse(count: int) -> dict[str, Any]:
    """Return the fields of an array of fewer lenses that is as wide as the paper's."""
    pitch_mm = ARRAY_MM / count
    return {"count": [count, count], "pitch_mm": pitch_mm, "focal_length_mm": pitch_mm * FOCAL_LENGTHS_A_PITCH}


def job_data(spec: JobSpec) -> dict[str, Any]:
    """Return a job for the file of numbers of a figure."""
    return spec.model_dump(mode="json", exclude={"title", "priority", "outputs", "display"})


def _array(job: str) -> dict[str, Any]:
    return dict(JOBS[job]["rig"]["lens_array"])


def _job(name: str, rig: dict[str, Any], camera: CameraModel, **more: Any) -> JobSpec:
    projection = {"projection": "perspective" if camera == "pinhole" else "orthographic"}
    # As in the paper, array and imaging lens stand in the scene as glass.
    return parse_spec({**JOBS[name], "rig": rig | {"camera": projection}, "capture": {"method": "glass"}, **more})
