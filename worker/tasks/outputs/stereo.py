"""Makers of videos for two eyes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from lippmann.errors import OutputError
from lippmann.job.outputs.stereo import AnaglyphVideo, PairOptions, StereoVideo
from lippmann.job.viewing import Stereo
from lippmann.lightfield.observer.stereo import eye_pair, together
from lippmann.lightfield.views.perspective import Eye, perspective
from lippmann.lightfield.views.square_pixels import as_square
from lippmann.lightfield.views.views import view
from worker.tasks.outputs.footage import Footage
from worker.tasks.outputs.making import Making
from worker.tasks.outputs.registry import describes, makes
from worker.tasks.outputs.videos import Picture, again, encode_shown


@makes(StereoVideo)
def make_stereo(making: Making, output: StereoVideo) -> None:
    """Make what two eyes see, side by side."""
    _encode(making, output, output.order, half_width=output.packing == "half")


@makes(AnaglyphVideo)
def make_anaglyph(making: Making, output: AnaglyphVideo) -> None:
    """Make what two eyes see, in one picture for red-cyan glasses."""
    _encode(making, output, "anaglyph")


@describes(StereoVideo, AnaglyphVideo)
def about_pair(footage: Footage, output: PairOptions) -> Mapping[str, Any]:
    """Return what a sidecar says of the two eyes, the left one first."""
    if output.views is not None:
        return {"views": [list(place) for place in output.views]}
    eyes = _eyes(footage, output, footage.frames[0])
    return {"eyes_mm": [[eye.x_mm, eye.y_mm, eye.distance_mm] for eye in eyes]}


def _encode(making: Making, output: PairOptions, how: Stereo, *, half_width: bool = False) -> None:
    def pictures() -> Iterator[Picture]:
        return (together(left, right, how) for left, right in _pairs(making.footage, output))

    footage = making.footage
    count = len(footage.frames) * output.repeat
    encode_shown(making, output, again(pictures, output.repeat), count=count, fps=footage.fps, half_width=half_width)


def _pairs(footage: Footage, output: PairOptions) -> Iterator[tuple[Picture, Picture]]:
    """Yield what the left and the right eye see of every frame."""
    layout = footage.layout
    for frame in footage.frames:
        image = footage.image(frame)
        if output.views is not None:
            left, right = (view(image.pixels, layout, u, v) for u, v in output.views)
        else:
            left, right = (perspective(image, eye).picture for eye in _eyes(footage, output, frame))
        yield as_square(left, layout), as_square(right, layout)


def _eyes(footage: Footage, output: PairOptions, frame: int) -> tuple[Eye, Eye]:
    distance_mm = output.distance_mm or footage.display.viewing_distance_mm
    least_mm = output.least_mm(footage.rig(frame))
    if distance_mm < least_mm:
        raise OutputError(
            f"expected eyes {output.apart_mm:g} mm apart at least {least_mm:.6g} mm from the display, where both see"
            f" its middle lens, got {distance_mm:g} mm"
        )
    return eye_pair(Eye(0.0, 0.0, distance_mm), apart_mm=output.apart_mm)
