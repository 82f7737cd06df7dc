"""The jobs of the paper as its sections 4.1 and 4.2 set them, and small stand-ins for the impatient.

A stand-in has fewer lenses and fewer pixels under each, and the same window and scene: pitch and focal length grow
together, so that cells look alike.
"""

from __future__ import annotations

from typing import Any, Literal

from lippmann.job.presets import JOBS
from lippmann.job.spec import JobSpec, parse_spec

ARRAY_MM = 100.0
"""Width of the array of the stills: 100 lenses of 1 mm."""

FOCAL_LENGTHS_A_PITCH = 3.3
"""f-number of item 630."""

POSITIONS_MM = (60, 40, 10, -10)
"""Of the MLA in Fig. 7 (a) to (d), from the image of the fish's central plane, + toward the imaging lens."""

_SWEEP = {"keyframes": [[frame, offset] for frame, offset in enumerate(POSITIONS_MM, start=1)]}

_STANDS_STILL = {"first": 0.0, "per_frame": 0.0}


def still(*, lattice: Literal["square", "hexagonal"], quick: bool) -> JobSpec:
    """Return a still of 100 x 100 lenses at 24 px, for 600 dpi; `quick`: 25 x 25 of 8 px."""
    array: dict[str, Any] = {**_array("paper-still"), "lattice": lattice}
    if quick:
        return _job("paper-still", {"lens_array": array | coarse(25), "px_per_lens": 8})
    return _job("paper-still", {"lens_array": array, "device": JOBS["paper-still"]["rig"]["device"]})


def sweep(*, px_per_lens: int | None) -> JobSpec:
    """Return the four positions of Fig. 7 as one job of four frames, in which nothing but the array moves.

    Parameters
    ----------
    px_per_lens
        None: 24, and 2400 x 2400 px at 600 dpi besides. A number: so many, and no device.
    """
    rig: dict[str, Any] = {"lens_array": {**_array("paper-still"), "offset_mm": _SWEEP}}
    if px_per_lens is None:
        rig["device"] = JOBS["paper-still"]["rig"]["device"]
    else:
        rig["px_per_lens"] = px_per_lens
    return _job("paper-still", rig, frames="1-4", clock=_STANDS_STILL)


def pixels_per_lens(px_per_lens: int, *, quick: bool) -> JobSpec:
    """Return a job of Fig. 8: 100 x 100 lenses of any number of pixels; `quick`: 20 x 20."""
    array = _array("paper-still") | (coarse(20) if quick else {})
    return _job("paper-still", {"lens_array": array, "px_per_lens": px_per_lens})


def video(*, frames: str, quick: bool, antialias: Any = "off") -> JobSpec:
    """Return the integral video: 90 x 90 lenses of 8 px; `quick`: 15 x 15."""
    array = _array("paper-iv") | (coarse(15) if quick else {})
    return _job("paper-iv", {"lens_array": array, "px_per_lens": 8}, frames=frames, render={"antialias": antialias})


def coarse(count: int) -> dict[str, Any]:
    """Return what makes an array of fewer lenses as wide as the paper's."""
    pitch_mm = ARRAY_MM / count
    return {"count": [count, count], "pitch_mm": pitch_mm, "focal_length_mm": pitch_mm * FOCAL_LENGTHS_A_PITCH}


def shown(spec: JobSpec) -> dict[str, Any]:
    """Return a job for a figure's numbers."""
    return spec.model_dump(mode="json", exclude={"title", "priority", "outputs", "display"})


def _array(job: str) -> dict[str, Any]:
    return dict(JOBS[job]["rig"]["lens_array"])


def _job(name: str, rig: dict[str, Any], **more: Any) -> JobSpec:
    # The paper's own road: array and imaging lens stand in the scene as glass.
    return parse_spec({**JOBS[name], "rig": rig, "capture": {"method": "glass"}, **more})
