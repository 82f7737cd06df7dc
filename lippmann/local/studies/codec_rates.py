"""Rate and distortion of an integral video under several codecs and quantizers, for its sheets and for its views.

Two ways to put an integral video into a codec are compared:

sheets   the integral video as it is, frame by frame: neighbouring pixels belong to different views
views    every view of every frame, one after the other as in `views.mp4`: a video in which little changes

Either way the decoded pixels are put together to sheets again, and these, and their views, are compared with the
originals as `lippmann compare` does.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice, product
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import LayoutError
from lippmann.job.outputs.codecs import Chroma, Codec
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.quality.compare import compare, compare_views, spread
from lippmann.lightfield.quality.rate_distortion import bd_rate
from lippmann.lightfield.views.views import grid_size, interlace, successive_views, view_of_grid, views_grid
from worker.video.encode import encode
from worker.video.kinds import Kind, kind
from worker.video.read import read_frames

Arrangement = Literal["sheets", "views"]
ARRANGEMENTS: tuple[Arrangement, ...] = get_args(Arrangement)
Codes = NDArray[np.uint8]
Encoder = Literal["x264", "x265", "svtav1", "vp9"]

ENCODERS: Mapping[Encoder, Codec] = {"x264": "h264", "x265": "h265", "svtav1": "av1", "vp9": "vp9"}
"""The encoders of a study, and the codec of each."""


@dataclass(frozen=True)
class Sequence8:
    """An integral video in 8-bit sRGB codes."""

    frames: Callable[[], Iterator[Codes]]
    """Returns an iterator over the orthoscopic sheets, from the first, each time it is called."""
    count: int
    layout: CellLayout
    fps: float


@dataclass(frozen=True)
class Point:
    """The rate and distortion of one way of coding: means over the frames, and over the views."""

    codec: Encoder
    arrangement: Arrangement
    qp: int
    bits: int
    bits_per_px: float
    """Bits per pixel of the sheets."""
    kbit_s: float
    psnr_y_db: float
    """PSNR of the luma of the sheets."""
    psnr_rgb_db: float
    view_psnr_y_db: float
    """PSNR of the luma, mean over the views."""
    view_psnr_y_min_db: float
    """PSNR of the luma of the worst view."""
    view_ssim: float
    """SSIM, mean over the views; NaN where the views are smaller than its window."""

    @property
    def curve(self) -> tuple[Encoder, Arrangement]:
        """The curve of the point."""
        return self.codec, self.arrangement


def study(
    video: Sequence8,
    *,
    codecs: Sequence[Encoder],
    arrangements: Sequence[Arrangement],
    qps: Sequence[int],
    chroma: Chroma,
    intra: bool,
    on_progress: Callable[[float, str], None],
) -> Iterator[Point]:
    """Yield a point for every codec, arrangement and quantizer.

    Parameters
    ----------
    video
        The integral video.
    codecs, arrangements, qps
        The encoders, the arrangements of the video and the quantizers that are combined.
    chroma
        The chroma subsampling.
    intra
        True to code every frame independently.
    on_progress
        Called with the fraction of the work and its description, before each point.

    Raises
    ------
    lippmann.errors.OutputError
        Before anything is coded, if a codec does not have a quantizer or the chroma.
    """
    runs = list(product(codecs, arrangements, qps))
    kinds = [kind(ENCODERS[codec], container="mkv", qp=qp, chroma=chroma, intra=intra) for codec, _, qp in runs]
    for number, (codec, arrangement, qp) in enumerate(runs):
        on_progress(number / len(runs), f"{codec} {arrangement} qp {qp}")
        yield _measured(video, codec, arrangement, qp, kinds[number])


def savings(points: Sequence[Point]) -> dict[tuple[Encoder, Arrangement], float]:
    """Return the BD-rate of every curve against the first one, by PSNR Y over the views; NaN where they do not meet."""
    curves: dict[tuple[Encoder, Arrangement], list[tuple[float, float]]] = {}
    for point in points:
        curves.setdefault(point.curve, []).append((point.bits_per_px, point.view_psnr_y_db))
    first = next(iter(curves.values()))
    return {name: _saving(first, curve) for name, curve in curves.items()}


def _saving(first: list[tuple[float, float]], curve: list[tuple[float, float]]) -> float:
    try:
        return bd_rate(first, curve)
    except LayoutError:  # one quantizer alone, or a curve that does not rise, compares with nothing
        return math.nan


def _measured(video: Sequence8, codec: Encoder, arrangement: Arrangement, qp: int, how: Kind) -> Point:
    layout = video.layout
    with TemporaryDirectory(prefix="lippmann-study-") as folder:
        path = Path(folder) / "coded.mkv"
        arranged = _as_views(video.frames(), layout) if arrangement == "views" else video.frames()
        bits = 8 * sum(encode(path, arranged, kind=how, fps=video.fps))
        frames = read_frames(path)
        decoded = _from_views(frames, layout) if arrangement == "views" else _cropped(frames, layout)
        numbers = [_distortion(first, second, layout) for first, second in zip(video.frames(), decoded, strict=True)]
    sheet_y, sheet_rgb, view_y, view_min, view_ssim = (
        spread(np.array([column])).mean for column in zip(*numbers, strict=True)
    )
    return Point(
        codec=codec,
        arrangement=arrangement,
        qp=qp,
        bits=bits,
        bits_per_px=bits / (layout.px * video.count),
        kbit_s=bits * video.fps / video.count / 1000,
        psnr_y_db=sheet_y,
        psnr_rgb_db=sheet_rgb,
        view_psnr_y_db=view_y,
        view_psnr_y_min_db=view_min,
        view_ssim=view_ssim,
    )


def _distortion(first: Codes, second: Codes, layout: CellLayout) -> tuple[float, float, float, float, float]:
    sheet, views = compare(first, second), compare_views(first, second, layout)
    over = spread(views.psnr_y_db)
    return sheet.psnr_y_db, sheet.psnr_rgb_db, over.mean, over.minimum, spread(views.ssim).mean


def _cropped(frames: Iterator[Codes], layout: CellLayout) -> Iterator[Codes]:
    # Sides that were made even for 4:2:0 come back so.
    return (frame[: layout.rows, : layout.cols] for frame in frames)


def _as_views(sheets: Iterator[Codes], layout: CellLayout) -> Iterator[Codes]:
    for number, sheet in enumerate(sheets):
        grid = views_grid(sheet, layout)
        for u, v in successive_views(layout, backward=number % 2 == 1):
            yield view_of_grid(grid, layout, u, v)


def _from_views(views: Iterator[Codes], layout: CellLayout) -> Iterator[Codes]:
    """Yield sheets of views in the order of `_as_views`; pixels under no lens are black."""
    for number in range(1_000_000):
        numbers = list(successive_views(layout, backward=number % 2 == 1))
        seen = list(islice(views, len(numbers)))
        if len(seen) < len(numbers):
            return
        grid = np.zeros((*grid_size(layout), 3), dtype=np.uint8)
        for (u, v), picture in zip(numbers, seen, strict=True):
            view_of_grid(grid, layout, u, v)[:] = picture[: layout.lens_rows, : layout.lens_cols]
        yield interlace(grid, layout)
