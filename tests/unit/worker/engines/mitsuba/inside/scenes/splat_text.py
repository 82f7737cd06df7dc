"""Small .ply files of Gaussian splats for tests."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

SH_0 = 0.28209479177387814
"""The spherical harmonic of degree 0."""


def write_splats(
    path: Path,
    centers: Any,
    sigmas: Any,
    *,
    opacities: Any,
    colours: Any,
    rotations: Any = None,
    rest: NDArray[np.float64] | None = None,
) -> Path:
    """Write splats as 3D Gaussian Splatting stores them; colours are sRGB values, rotations have w first.

    `rest` has the f_rest_* as columns.
    """
    count = len(centers)
    rest = np.zeros((count, 0)) if rest is None else rest
    turned = np.tile([1.0, 0, 0, 0], (count, 1)) if rotations is None else np.asarray(rotations, float)
    alpha = np.asarray(opacities, float).reshape(count, 1)
    columns = [
        np.asarray(centers, float),
        (np.asarray(colours, float) - 0.5) / SH_0,
        rest,
        np.log(alpha / (1 - alpha)),
        np.log(np.asarray(sigmas, float)),
        turned,
    ]
    names = ["x", "y", "z", *(f"f_dc_{i}" for i in range(3)), *(f"f_rest_{i}" for i in range(rest.shape[1])), "opacity"]
    names += [*(f"scale_{i}" for i in range(3)), *(f"rot_{i}" for i in range(4))]
    return write_table(path, names, np.concatenate(columns, axis=1))


def write_table(path: Path, names: list[str], table: NDArray[np.float64]) -> Path:
    """Write a .ply with one element of float properties."""
    head = ["ply", "format binary_little_endian 1.0", f"element vertex {len(table)}"]
    head += [*(f"property float {name}" for name in names), "end_header", ""]
    path.write_bytes("\n".join(head).encode() + table.astype("<f4").tobytes())
    return path
