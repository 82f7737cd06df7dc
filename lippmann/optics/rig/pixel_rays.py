"""The rays of all pixels of a picture, or of a region of it, by the exact trace."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from lippmann.optics.lens.trace import Rays
from lippmann.optics.rig import array as lattice
from lippmann.optics.rig.bench import WHOLE, Bench, object_rays, pixel_centres_mm

BAND_PX = 50_000
"""The number of pixels that are traced at once: few enough that they stay in the processor's cache (twice as fast as a
whole frame) and that a frame of any size needs little memory."""

OUTER_LENSES = 16
OUTER_POINTS = 9
"""The numbers of lenses, and of points in each of their cells, in either direction, whose rays represent all."""


def ray_bands(bench: Bench, *, rows: int, cols: int, region: tuple[slice, slice] = WHOLE) -> Iterator[Rays]:
    """Yield the rays of pixels in the space of the scene, some rows at a time; see `pixel_rays`.

    Parameters
    ----------
    bench
        The bench of the rig.
    rows
        The pixel rows of the whole picture.
    cols
        The pixel columns of the whole picture.
    region
        The rows and columns that are wanted, as two slices; all of them by default.
    """
    wanted, across = range(rows)[region[0]], range(cols)[region[1]]
    step = max(1, BAND_PX // len(across))
    for start in range(wanted.start, wanted.stop, step):
        band = slice(start, min(start + step, wanted.stop)), region[1]
        yield object_rays(bench, pixel_centres_mm(bench, rows=rows, cols=cols, region=band))


def pixel_rays(bench: Bench, *, rows: int, cols: int, region: tuple[slice, slice] = WHOLE) -> Rays:
    """Return the rays of pixels in the space of the scene, each array (row, col, 3), mm; NaN for a dead pixel.

    Parameters
    ----------
    bench
        The bench of the rig.
    rows, cols
        The size of the whole picture, which shows the window of the bench.
    region
        The rows and columns that are wanted, as two slices.
    """
    return joined(ray_bands(bench, rows=rows, cols=cols, region=region))


def joined(parts: Iterable[Rays]) -> Rays:
    """Return rays of several parts as one bundle, along the first axis of their arrays."""
    parts = list(parts)
    return Rays(np.concatenate([part.position for part in parts]), np.concatenate([part.direction for part in parts]))


def outer_rays(bench: Bench) -> Rays:
    """Return rays with about the same extent and slopes as those of all pixels, (lens, ray, 3); NaN if one is dead.

    The rays are those of a grid over the cells of some lenses, including the outermost ones. Their extent does not
    depend on the tiles of a picture.
    """
    array = bench.rig.lens_array
    rows, cols = (np.unique(np.linspace(0, count - 1, OUTER_LENSES).round().astype(int)) for count in array.count)
    centres = lattice.lens_centres_mm(array)[np.ix_(rows, cols)].reshape(-1, 1, 2)
    half_mm = array.pitch_mm * np.array([0.5, array.lenses_mm.cell.half_height])
    across = np.stack(np.meshgrid(*[np.linspace(-1, 1, OUTER_POINTS)] * 2), axis=-1).reshape(-1, 2)
    return object_rays(bench, centres + across * half_mm)


def front_mm(bench: Bench) -> float:
    """Return the z from which the rays may start: surface 1 of the imaging lens, or the array without one."""
    return bench.mla_z_mm if bench.imaging_lens is None else 0.0
