"""Frames through codecs and back: what comes out, what it costs, and what a codec does not have."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from worker.errors import OutputError
from worker.integral.compare import compare
from worker.video.coded import CODECS, CodecName, code

Codes = NDArray[np.uint8]


def wandering(count: int = 4, rows: int = 72, cols: int = 70) -> list[Codes]:
    """Return smooth coloured frames that move by two pixels a frame."""
    row, col = np.mgrid[0:rows, 0:cols]
    waves = (80 * np.sin((col - 2 * n) / 9) for n in range(count))
    still = [60 * np.cos(row / 7), 50 * np.sin(row / 11)]
    return [(120 + np.stack([wave, *still], axis=-1)).astype(np.uint8) for wave in waves]


@pytest.mark.parametrize("codec", CODECS)
def test_every_frame_comes_back_in_order_and_a_coarser_quantizer_costs_less_and_shows(codec: CodecName) -> None:
    frames = wandering()
    fine, coarse = (code(frames, codec=codec, qp=qp) for qp in (20, 45))
    assert coarse.bits < fine.bits
    decoded = list(fine.frames()), list(coarse.frames())
    assert len(decoded[0]) == len(decoded[1]) == len(frames)
    for number, original in enumerate(frames):
        fine_db, coarse_db = (compare(original, one[number]).psnr_y_db for one in decoded)
        assert fine_db > 36
        assert fine_db > coarse_db
        others = [compare(original, other).psnr_y_db for place, other in enumerate(decoded[0]) if place != number]
        assert fine_db > max(others), "in the order in which they went in"


@pytest.mark.parametrize("codec", CODECS)
def test_frames_that_stand_alone_cost_more_where_little_changes(codec: CodecName) -> None:
    frames = wandering()
    assert code(frames, codec=codec, qp=30, intra=True).bits > code(frames, codec=codec, qp=30).bits


@pytest.mark.parametrize("codec", ["x264", "x265", "vp9"])
def test_with_chroma_at_full_resolution_colours_that_change_from_pixel_to_pixel_survive(codec: CodecName) -> None:
    red_and_blue = np.zeros((64, 64, 3), dtype=np.uint8)
    red_and_blue[:, ::2, 0] = red_and_blue[:, 1::2, 2] = 200
    (full,), (half,) = (
        list(code([red_and_blue], codec=codec, qp=8, chroma=chroma).frames()) for chroma in ("444", "420")
    )
    assert compare(red_and_blue, full).psnr_rgb_db > 35
    assert compare(red_and_blue, half).psnr_rgb_db < 20


@pytest.mark.parametrize("codec", CODECS)
def test_odd_sides_come_back_as_they_were(codec: CodecName) -> None:
    (decoded,) = code(wandering(1, 71, 69), codec=codec, qp=20).frames()
    assert decoded.shape == (71, 69, 3)


def test_what_a_codec_does_not_have_is_named() -> None:
    with pytest.raises(OutputError, match="expected a quantizer from 0 to 51 for x264, got 52"):
        code(wandering(1), codec="x264", qp=52)
    with pytest.raises(OutputError, match="expected chroma 420 for svtav1, got 444"):
        code(wandering(1), codec="svtav1", qp=30, chroma="444")
    with pytest.raises(OutputError, match="at least one frame"):
        code([], codec="x264", qp=30)
    with pytest.raises(OutputError, match=r"expected frames \(72, 70, 3\) like the first, got \(10, 10, 3\) as 1"):
        code([*wandering(1), np.zeros((10, 10, 3), np.uint8)], codec="x264", qp=30)
