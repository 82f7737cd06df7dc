"""Movies for the tests of worker.video."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def noise(count: int, rows: int, cols: int) -> list[NDArray[np.uint8]]:
    """Return frames of codes that no compression shortens."""
    return list(np.random.default_rng(3).integers(0, 256, (count, rows, cols, 3), dtype=np.uint8))


def waves(count: int, rows: int, cols: int) -> list[NDArray[np.uint8]]:
    """Return smooth frames that move."""
    row, col = np.mgrid[:rows, :cols]
    phases = [np.stack([col / 19 + t / 3, row / 17 + t / 4, (row + col) / 31 - t / 5], axis=2) for t in range(count)]
    return [np.rint(128 + 100 * np.sin(phase)).astype(np.uint8) for phase in phases]


def psnr_db(shown: NDArray[np.uint8], given: NDArray[np.uint8]) -> float:
    """Return the peak signal-to-noise ratio of one picture against another."""
    mean_square = np.mean((shown.astype(np.float64) - given) ** 2)
    return float(10 * np.log10(255**2 / mean_square))
