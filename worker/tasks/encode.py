"""Frames into videos: one row of a table for each output."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from worker.errors import Stopped
from worker.images.colour import srgb_codes
from worker.images.read import read_rgb
from worker.integral.square_pixels import as_square, square_size
from worker.integral.views import centre, successive_views, view_numbers, view_of_grid
from worker.job.orders import Order
from worker.job.sheet import JobSheet
from worker.plan import names
from worker.plan.sampling import display_size
from worker.tasks.attempt import Work
from worker.tasks.watch import Watch
from worker.tasks.workplace import Workplace
from worker.video.encode import FFV1, H264, Frame, Kind, encode
from worker.video.size import screen_scale

VIEWS_FPS = 24.0
"""Views a second of `views.mp4`: a frame of 8 x 8 views takes 2.7 s."""

Read = Callable[[str], NDArray[np.float16]]
"""Returns a master of the job."""


@dataclass(frozen=True)
class _Video:
    pictures: Callable[[JobSheet, Read], Iterator[Frame]]
    count: Callable[[JobSheet], int]
    """How many pictures."""
    fps: Callable[[JobSheet], float]
    kind: Kind


def encode_output(place: Workplace, order: Order, watch: Watch) -> Work:
    """Make the video that an order names out of a job's frames."""
    assert order.output is not None  # noqa: S101 - the dispatcher's promise
    artifact = names.job_artifact(order.job_id, names.video_name(order.output))
    if place.store.exists(artifact):
        return Work()
    sheet, made = place.job_sheet(order.job_id), _VIDEOS[order.output]

    def read(name: str) -> NDArray[np.float16]:
        with place.store.local_path(names.job_artifact(order.job_id, name)) as path:
            return read_rgb(path, np.float16)

    count = made.count(sheet)

    def watched() -> Iterator[Frame]:
        for number, picture in enumerate(made.pictures(sheet, read)):
            if watch.should_stop():
                raise Stopped
            watch.progress = number / count
            yield picture

    scale = screen_scale(*square_size(display_size(sheet.spec.rig))) if made.kind is H264 else 1
    with place.task_folder() as folder:
        video = folder / order.output
        encode(video, watched(), kind=made.kind, fps=made.fps(sheet), scale=scale)
        place.store.put_file(artifact, video)
    return Work()


def _all_views(sheet: JobSheet, read: Read) -> Iterator[Frame]:
    """Every view of every frame; every second frame backward, so that nothing jumps."""
    layout = display_size(sheet.spec.rig)
    for number, frame in enumerate(sheet.spec.frame_numbers):
        grid = read(names.views_name(frame))
        for u, v in successive_views(layout, backward=number % 2 == 1):
            yield srgb_codes(as_square(view_of_grid(grid, layout, u, v), layout))


def _centre_views(sheet: JobSheet, read: Read) -> Iterator[Frame]:
    """Return the centre view in time."""
    layout = display_size(sheet.spec.rig)
    for frame in sheet.spec.frame_numbers:
        grid = read(names.views_name(frame))
        yield srgb_codes(as_square(view_of_grid(grid, layout, *centre(layout)), layout))


def _orthoscopic(sheet: JobSheet, read: Read) -> Iterator[Frame]:
    """Return the integral video itself, pixel for pixel."""
    for frame in sheet.spec.frame_numbers:
        yield srgb_codes(read(names.orthoscopic_name(frame)))


def _frames(sheet: JobSheet) -> int:
    return len(sheet.spec.frame_numbers)


def _views(sheet: JobSheet) -> int:
    return _frames(sheet) * len(view_numbers(display_size(sheet.spec.rig)))


def _fps(sheet: JobSheet) -> float:
    return sheet.spec.fps


_VIDEOS: dict[str, _Video] = {
    "views.mp4": _Video(_all_views, _views, lambda _: VIEWS_FPS, H264),
    "centre.mp4": _Video(_centre_views, _frames, _fps, H264),
    "orthoscopic.mkv": _Video(_orthoscopic, _frames, _fps, FFV1),
}
