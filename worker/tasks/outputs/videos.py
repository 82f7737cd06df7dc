"""Makers of videos: frames of the footage into pictures, one at a time, and these into a file."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from worker.images.colour import srgb_codes
from worker.integral.square_pixels import as_square, square_size
from worker.integral.views import centre, successive_views, view, view_numbers
from worker.job.outputs.codecs import Bits
from worker.job.outputs.videos import CentreVideo, OrthoscopicVideo, VideoOptions, ViewsVideo
from worker.tasks.outputs.footage import Footage
from worker.tasks.outputs.making import Making
from worker.video.encode import Frame, encode
from worker.video.kinds import Kind, kind
from worker.video.size import screen_scale


def make_views(making: Making, output: ViewsVideo) -> None:
    """Make the movie of every view of every frame."""
    footage = making.footage
    count = len(footage.frames) * len(view_numbers(footage.layout))
    _of_views(making, output, _all_views(footage, output.bits), count, output.views_per_s)


def make_centre(making: Making, output: CentreVideo) -> None:
    """Make the centre view in time."""
    footage = making.footage
    _of_views(making, output, _centre_views(footage, output.bits), len(footage.frames), footage.fps)


def make_orthoscopic(making: Making, output: OrthoscopicVideo) -> None:
    """Make the integral video itself."""
    footage = making.footage
    sheets = (srgb_codes(footage.orthoscopic(frame), bits=output.bits) for frame in footage.frames)
    _encode(making, output, sheets, len(footage.frames), footage.fps, scale=1)


def _all_views(footage: Footage, bits: Bits) -> Iterator[Frame]:
    layout = footage.layout
    for number, frame in enumerate(footage.frames):
        sheet = footage.orthoscopic(frame)
        for u, v in successive_views(layout, backward=number % 2 == 1):
            yield srgb_codes(as_square(view(sheet, layout, u, v), layout), bits=bits)


def _centre_views(footage: Footage, bits: Bits) -> Iterator[Frame]:
    layout = footage.layout
    for frame in footage.frames:
        yield srgb_codes(as_square(view(footage.orthoscopic(frame), layout, *centre(layout)), layout), bits=bits)


def _of_views(making: Making, output: VideoOptions, pictures: Iterator[Frame], count: int, fps: float) -> None:
    """Encode pictures that are as small as views: enlarged for people, pixel for pixel without loss."""
    scale = 1 if output.codec == "ffv1" else screen_scale(*square_size(making.footage.layout))
    _encode(making, output, pictures, count, fps, scale=scale)


def _encode(
    making: Making, output: VideoOptions, pictures: Iterator[Frame], count: int, fps: float, *, scale: int
) -> None:
    watched = making.told(pictures, count)
    as_asked = kind_of(output)

    def write(path: Path) -> None:
        encode(path, watched, kind=as_asked, fps=fps, scale=scale)

    making.keep(output.file_name, write)


def kind_of(output: VideoOptions) -> Kind:
    """Return how a video is encoded."""
    return kind(output.codec, container=output.container, crf=output.crf, chroma=output.chroma, bits=output.bits)
