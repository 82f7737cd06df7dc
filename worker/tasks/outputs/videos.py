"""Makers of videos in which every frame has its turn."""

from __future__ import annotations

from collections.abc import Iterator

from lippmann.job.outputs.videos import CentreVideo, IntegralVideo, OrthoscopicVideo, ViewsVideo
from lippmann.lightfield.views.square_pixels import as_square
from lippmann.lightfield.views.views import centre, successive_views, view, view_numbers
from worker.tasks.outputs.encoding import Picture, again, encode_pixels, encode_shown
from worker.tasks.outputs.footage import Footage
from worker.tasks.outputs.making import Making
from worker.tasks.outputs.registry import makes


@makes(ViewsVideo)
def make_views(making: Making, output: ViewsVideo) -> None:
    """Make the movie of every view of every frame."""
    footage = making.footage
    count = len(footage.frames) * len(view_numbers(footage.layout))
    encode_shown(making, output, _all_views(footage), count=count, fps=output.views_per_s)


@makes(CentreVideo)
def make_centre(making: Making, output: CentreVideo) -> None:
    """Make the centre view in time."""
    footage, layout = making.footage, making.footage.layout

    def views() -> Iterator[Picture]:
        for frame in footage.frames:
            yield as_square(view(footage.image(frame).pixels, layout, *centre(layout)), layout)

    count = len(footage.frames) * output.repeat
    encode_shown(making, output, again(views, output.repeat), count=count, fps=footage.fps)


@makes(OrthoscopicVideo)
def make_orthoscopic(making: Making, output: OrthoscopicVideo) -> None:
    """Make the integral video itself."""
    footage = making.footage
    sheets = (footage.image(frame).pixels for frame in footage.frames)
    encode_pixels(making, output, sheets, count=len(footage.frames), fps=footage.fps)


@makes(IntegralVideo)
def make_integral(making: Making, output: IntegralVideo) -> None:
    """Make the integral video as it was captured."""
    footage = making.footage
    sheets = (footage.integral(frame) for frame in footage.frames)
    encode_pixels(making, output, sheets, count=len(footage.frames), fps=footage.fps)


def _all_views(footage: Footage) -> Iterator[Picture]:
    layout = footage.layout
    for number, frame in enumerate(footage.frames):
        sheet = footage.image(frame).pixels
        for u, v in successive_views(layout, backward=number % 2 == 1):
            yield as_square(view(sheet, layout, u, v), layout)
