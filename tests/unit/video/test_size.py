"""Sizes for screens."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from worker.video.size import SCREEN_PX, even_sided, screen_scale


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
