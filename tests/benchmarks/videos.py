"""What a video of views costs beside its codec."""

from __future__ import annotations

import time
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
from av.video.codeccontext import VideoCodecContext
from numpy.typing import NDArray

from lippmann.lattice.layout import CellLayout
from tests.builders_outputs import GivenJob, given_job
from tests.unit.lippmann.lightfield.textures import sheet_of_texture
from worker.video.kinds import H264

LAYOUT = CellLayout(90, 90, px_per_lens=8)
VIEWS_PER_S = 24
ROUNDS = 3


def cpu_ratio(folder: Path) -> str:
    """Return the CPU time of `views.mp4` by that of x264 alone, of the same pictures as it takes them; best of some."""
    sheets = {1: _sheet(30.0), 2: _sheet(-20.0)}
    job = given_job(folder, sheets, frames="1-2", count=(90, 90), px_per_lens=8, outputs=["views.mp4"])
    given = _taken_by_the_codec(job)
    ours_s, codec_s = [], []
    for _ in range(ROUNDS):
        codec_s.append(_took_s(lambda: _codec_alone(given)))
        job.remove("views.mp4")
        ours_s.append(_took_s(lambda: job.make("views.mp4")))
    return f"{min(ours_s) / min(codec_s):.2f}"


def _sheet(depth_mm: float) -> NDArray[np.float32]:
    def waves(x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
        light: NDArray[np.float64] = 0.5 + 0.2 * np.sin(x / 2) * np.cos(y / 3) + 0.3 * ((np.floor(x / 4 + y / 7)) % 2)
        return light

    return np.repeat(sheet_of_texture(LAYOUT, waves, depth_mm, focal_mm=3.3), 3, axis=2)


def _taken_by_the_codec(job: GivenJob) -> list[av.VideoFrame]:
    """Return the pictures of the video as FFmpeg decodes them: of the size and in the colours that x264 takes."""
    job.make("views.mp4")
    with job.file("video/views.mp4") as path, av.open(str(path), "r") as container:
        return list(container.decode(video=0))


def _codec_alone(pictures: list[av.VideoFrame]) -> None:
    coder = VideoCodecContext.create(H264.encoder, "w")
    assert isinstance(coder, VideoCodecContext)
    coder.width, coder.height, coder.pix_fmt = pictures[0].width, pictures[0].height, H264.pixel_format
    coder.framerate, coder.time_base = Fraction(VIEWS_PER_S), Fraction(1, VIEWS_PER_S)
    coder.options = dict(H264.settings)
    for number, picture in enumerate(pictures):
        picture.pts, picture.time_base, picture.pict_type = number, coder.time_base, 0
        coder.encode(picture)
    coder.encode(None)


def _took_s(work: Callable[[], None]) -> float:
    started_s = time.process_time()
    work()
    return time.process_time() - started_s
