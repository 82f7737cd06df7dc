"""Pictures for the tests of worker.images, and a decoder that is not OpenImageIO."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path
from typing import Any

import av
import numpy as np
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from numpy.typing import NDArray

SHAPES = st.tuples(st.integers(1, 40), st.integers(1, 40), st.just(3))
HALVES = hnp.arrays(np.float16, SHAPES, elements=st.floats(-1, 4, width=16))


def noise(rows: int, cols: int, dtype: type = np.float16) -> NDArray[Any]:
    """Return a picture of light from 0 to 1 that no compression shortens."""
    light: NDArray[Any] = np.random.default_rng(7).random((rows, cols, 3)).astype(dtype)
    return light


def decoded(source: bytes | Path, pixel_format: str) -> NDArray[Any]:
    """Return a PNG or WebP as FFmpeg decodes it."""
    with av.open(BytesIO(source) if isinstance(source, bytes) else str(source), "r") as container:
        frame = next(container.decode(video=0))
        return frame.to_ndarray(format=pixel_format)
