"""sRGB (IEC 61966-2-1) as it is printed, for tests: the product's own formulas are what is tested."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray


def encoded_srgb(light: NDArray[Any]) -> NDArray[np.float64]:
    """Return the encoded values, 0 to 1, of linear light of any shape; light outside 0 to 1 is clipped."""
    clipped = np.clip(light.astype(np.float64), 0, 1)
    return np.where(clipped <= 0.0031308, 12.92 * clipped, 1.055 * clipped ** (1 / 2.4) - 0.055)


def linear_of(encoded: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the linear light of encoded values, 0 to 1, of any shape."""
    return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
