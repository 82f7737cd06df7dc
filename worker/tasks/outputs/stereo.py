"""Makers of videos for two eyes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from lippmann.errors import OutputError
from lippmann.job.optics.viewing import Stereo
from lippmann.job.outputs.stereo import AnaglyphVideo, PairOptions, StereoVideo
from lippmann.lightfield.observer.stereo import eye_pair, together
from lippmann.lightfield.views.perspective import Eye, perspective
from lippmann.lightfield.views.square_pixels import as_square
from lippmann.lightfield.views.views import view
from worker.tasks.outputs.context import OutputContext
from worker.tasks.outputs.frame_source import FrameSource
from worker.tasks.outputs.registry import describes, makes
from worker.tasks.outputs.videos import Picture, again, encode_shown


@makes(StereoVideo)
def make_stereo(context: OutputContext, output: StereoVideo) -> None:
    """Make the video of what two eyes see, side by side."""
    _encode(context, output, output.order, half_width=output.packing == "half")


@makes(AnaglyphVideo)
def make_anaglyph(context: OutputContext, output: AnaglyphVideo) -> None:
    """Make the video of what two eyes see, in one picture for red-cyan glasses."""
    _encode(context, output, "anaglyph")


@describes(StereoVideo, AnaglyphVideo)
def about_pair(source: FrameSource, output: PairOptions) -> Mapping[str, Any]:
    """Describe the two eyes for the sidecar, the left one first."""
    if output.views is not None:
        return {"views": [list(place) for place in output.views]}
    eyes = _eyes(source, output, source.frames[0])
    return {"eyes_mm": [[eye.x_mm, eye.y_mm, eye.distance_mm] for eye in eyes]}


def _encode(context: OutputContext, output: PairOptions, how: Stereo, *, half_width: bool = False) -> None:
    def pictures() -> Iterator[Picture]:
        return (together(left, right, how) for left, right in _pairs(context.source, output))

    source = context.source
    count = len(source.frames) * output.repeat
    encode_shown(context, output, again(pictures, output.repeat), count=count, fps=source.fps, half_width=half_width)


def _pairs(source: FrameSource, output: PairOptions) -> Iterator[tuple[Picture, Picture]]:
    """Yield the pictures that the left and the right eye see of every frame."""
    layout = source.layout
    for frame in source.frames:
        image = source.image(frame)
        if output.views is not None:
            left, right = (view(image.pixels, layout, u, v) for u, v in output.views)
        else:
            left, right = (perspective(image, eye).picture for eye in _eyes(source, output, frame))
        yield as_square(left, layout), as_square(right, layout)


def _eyes(source: FrameSource, output: PairOptions, frame: int) -> tuple[Eye, Eye]:
    distance_mm = output.distance_mm or source.display.viewing_distance_mm
    least_mm = output.least_mm(source.rig(frame))
    if distance_mm < least_mm:
        raise OutputError(
            f"expected eyes {output.apart_mm:g} mm apart at least {least_mm:.6g} mm from the display, where both see"
            f" its middle lens, got {distance_mm:g} mm"
        )
    return eye_pair(Eye(0.0, 0.0, distance_mm), apart_mm=output.apart_mm)
