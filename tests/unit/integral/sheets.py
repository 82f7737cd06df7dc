"""Sheets and layouts for the tests of worker.integral."""

from __future__ import annotations

import numpy as np
from hypothesis import strategies as st
from numpy.typing import NDArray

from worker.integral.layout import CellLayout

LAYOUTS = st.builds(
    CellLayout,
    lens_rows=st.integers(1, 5),
    lens_cols=st.integers(1, 5),
    px_per_lens=st.integers(1, 5),
)
CHANNELS = st.integers(1, 4)
DTYPES = st.sampled_from([np.uint8, np.uint16, np.float16, np.float32])


def numbered_sheet(layout: CellLayout, channels: int = 3, dtype: type = np.float32) -> NDArray[np.generic]:
    """Return a sheet in which, dtype permitting, every number differs."""
    count = layout.rows * layout.cols * channels
    numbers: NDArray[np.generic] = np.arange(count).astype(dtype).reshape(layout.rows, layout.cols, channels)
    return numbers
