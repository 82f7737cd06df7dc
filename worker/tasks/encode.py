"""Frames into videos: one function for each output."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from worker.errors import Stopped
from worker.images.colour import srgb_codes
from worker.images.read import read_rgb
from worker.images.resize import resize
from worker.integral.layout import CellLayout
from worker.integral.views import centre, successive_views, view_of_grid
from worker.job.orders import Order
from worker.job.sheet import JobSheet
from worker.plan import names
from worker.plan.sampling import frame_size
from worker.tasks.attempt import Work
from worker.tasks.watch import Watch
from worker.tasks.workplace import Workplace
from worker.video.encode import FFV1, H264, Kind, encode
from worker.video.size import screen_scale

VIEWS_FPS = 24.0
"""Views a second of `views.mp4`: a frame of 8 x 8 views takes 2.7 s."""

Picture = NDArray[np.floating[Any]]
"""Linear light, `(rows, cols, 3)`."""
Read = Callable[[str], Picture]
Pictures = Callable[[JobSheet, Read], Iterator[Picture]]


def encode_output(place: Workplace, order: Order, watch: Watch) -> Work:
    """Make the video that an order names out of a job's frames."""
    assert order.output is not None  # noqa: S101 - the dispatcher's promise
    artifact = names.job_artifact(order.job_id, names.video_name(order.output))
    if place.store.exists(artifact):
        return Work()
    sheet = place.job_sheet(order.job_id)
    pictures, kind = _OUTPUTS[order.output]

    def read(name: str) -> Picture:
        if watch.should_stop():
            raise Stopped
        with place.store.local_path(names.job_artifact(order.job_id, name)) as path:
            return read_rgb(path, np.float16)

    fps = VIEWS_FPS if order.output == "views.mp4" else sheet.spec.fps
    with place.task_folder() as folder:
        video = folder / order.output
        encode(video, _coded(pictures(sheet, read), _count(sheet, order.output), watch), kind=kind, fps=fps)
        place.store.put_file(artifact, video)
    return Work()


def _all_views(sheet: JobSheet, read: Read) -> Iterator[Picture]:
    """Every view of every frame; every second frame backward, so that nothing jumps."""
    layout = frame_size(sheet.spec.rig)
    for number, frame in enumerate(sheet.spec.frame_numbers):
        grid = read(names.views_name(frame))
        for u, v in successive_views(layout, backward=number % 2 == 1):
            yield _enlarged(view_of_grid(grid, layout, u, v), layout)


def _centre_views(sheet: JobSheet, read: Read) -> Iterator[Picture]:
    """Return the centre view in time."""
    layout = frame_size(sheet.spec.rig)
    for frame in sheet.spec.frame_numbers:
        yield _enlarged(view_of_grid(read(names.views_name(frame)), layout, *centre(layout)), layout)


def _orthoscopic(sheet: JobSheet, read: Read) -> Iterator[Picture]:
    """Return the integral video itself, pixel for pixel."""
    for frame in sheet.spec.frame_numbers:
        yield read(names.orthoscopic_name(frame))


_OUTPUTS: dict[str, tuple[Pictures, Kind]] = {
    "views.mp4": (_all_views, H264),
    "centre.mp4": (_centre_views, H264),
    "orthoscopic.mkv": (_orthoscopic, FFV1),
}


def _enlarged(view: Picture, layout: CellLayout) -> Picture:
    scale = screen_scale(layout.lens_rows, layout.lens_cols)
    return resize(view, rows=layout.lens_rows * scale, cols=layout.lens_cols * scale) if scale > 1 else view


def _count(sheet: JobSheet, output: str) -> int:
    frames = len(sheet.spec.frame_numbers)
    return frames * sheet.spec.rig.px_per_lens**2 if output == "views.mp4" else frames


def _coded(pictures: Iterator[Picture], count: int, watch: Watch) -> Iterator[NDArray[np.uint8]]:
    for number, picture in enumerate(pictures):
        watch.progress = number / count
        yield srgb_codes(picture)
