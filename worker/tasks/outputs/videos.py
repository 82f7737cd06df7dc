"""Makers of videos: frames of the footage into pictures, one at a time, and these into a file."""

from __future__ import annotations

from collections.abc import Iterator

from worker.images.colour import srgb_codes
from worker.integral.square_pixels import as_square, square_size
from worker.integral.views import centre, successive_views, view, view_numbers
from worker.job.outputs.videos import CentreVideo, OrthoscopicVideo, VideoOptions, ViewsVideo
from worker.tasks.outputs.footage import Footage
from worker.tasks.outputs.making import Making
from worker.video.encode import FFV1, H264, Frame, encode
from worker.video.size import screen_scale

KINDS = {"h264": H264, "ffv1": FFV1}


def make_views(making: Making, output: ViewsVideo) -> None:
    """Make the movie of every view of every frame."""
    footage = making.footage
    count = len(footage.frames) * len(view_numbers(footage.layout))
    _of_views(making, output, _all_views(footage), count, output.views_per_s)


def make_centre(making: Making, output: CentreVideo) -> None:
    """Make the centre view in time."""
    footage = making.footage
    _of_views(making, output, _centre_views(footage), len(footage.frames), footage.fps)


def make_orthoscopic(making: Making, output: OrthoscopicVideo) -> None:
    """Make the integral video itself."""
    footage = making.footage
    sheets = (srgb_codes(footage.orthoscopic(frame)) for frame in footage.frames)
    _encode(making, output, sheets, len(footage.frames), footage.fps, scale=1)


def _all_views(footage: Footage) -> Iterator[Frame]:
    layout = footage.layout
    for number, frame in enumerate(footage.frames):
        sheet = footage.orthoscopic(frame)
        for u, v in successive_views(layout, backward=number % 2 == 1):
            yield srgb_codes(as_square(view(sheet, layout, u, v), layout))


def _centre_views(footage: Footage) -> Iterator[Frame]:
    layout = footage.layout
    for frame in footage.frames:
        yield srgb_codes(as_square(view(footage.orthoscopic(frame), layout, *centre(layout)), layout))


def _of_views(making: Making, output: VideoOptions, pictures: Iterator[Frame], count: int, fps: float) -> None:
    """Encode pictures that are as small as views: enlarged for people, pixel for pixel without loss."""
    scale = 1 if output.codec == "ffv1" else screen_scale(*square_size(making.footage.layout))
    _encode(making, output, pictures, count, fps, scale=scale)


def _encode(
    making: Making, output: VideoOptions, pictures: Iterator[Frame], count: int, fps: float, *, scale: int
) -> None:
    watched = making.told(pictures, count)
    making.keep(output.file_name, lambda path: encode(path, watched, kind=KINDS[output.codec], fps=fps, scale=scale))
