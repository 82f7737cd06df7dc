"""Sizes for screens."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from worker.video.encode import encode
from worker.video.kinds import H264
from worker.video.read import read_frames
from worker.video.size import SCREEN_PX, at_least, even_sided, screen_scale


@given(rows=st.integers(1, 5000), cols=st.integers(1, 5000))
def test_the_longer_side_comes_nearest_to_the_screen(rows: int, cols: int) -> None:
    scale, longer = screen_scale(rows, cols), max(rows, cols)
    distances = {factor: abs(factor * longer - SCREEN_PX) for factor in (scale - 1, scale, scale + 1) if factor >= 1}
    assert distances[scale] == min(distances.values())


@given(rows=st.integers(1, 9), cols=st.integers(1, 9))
def test_even_sides_keep_the_frame_and_repeat_its_edge(rows: int, cols: int) -> None:
    frame = np.arange(rows * cols * 3, dtype=np.uint8).reshape(rows, cols, 3)
    even = even_sided(frame)
    assert even.shape == (rows + rows % 2, cols + cols % 2, 3)
    np.testing.assert_array_equal(even[:rows, :cols], frame)
    np.testing.assert_array_equal(even[-1, :cols], frame[-1])
    np.testing.assert_array_equal(even[:rows, -1], frame[:, -1])


@pytest.mark.parametrize("scale", [1, 3, 8])
def test_an_enlarged_video_keeps_edges_where_they_are(tmp_path: Path, scale: int) -> None:
    frame = np.zeros((16, 16, 3), np.uint8)
    frame[:, 8:] = 255
    encode(tmp_path / "edge.mp4", [frame] * 3, kind=H264, fps=8, scale=scale)
    decoded = next(read_frames(tmp_path / "edge.mp4"))
    assert decoded.shape == (16 * scale, 16 * scale, 3)
    bright = decoded[..., 1].astype(int).mean(axis=0) > 127
    assert bright.tolist() == [False] * (8 * scale) + [True] * (8 * scale)


def test_a_small_frame_goes_on_with_its_last_row_and_col_and_a_large_one_stays() -> None:
    frame = np.arange(2 * 3 * 3, dtype=np.uint8).reshape(2, 3, 3)
    larger = at_least(frame, rows=4, cols=5)
    assert larger.shape == (4, 5, 3)
    assert (larger[:2, :3] == frame).all()
    assert (larger[2:, :3] == frame[1]).all()
    assert (larger[:, 3:] == larger[:, 2:3]).all()
    assert at_least(frame, rows=2, cols=1) is frame
