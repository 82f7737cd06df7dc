"""Weighted sums of the pixels of a sheet: separable, for several pictures at once, by matrix products.

Refocusing asks every pixel of a picture for a few pixels of the sheet, the same down for every column and the same
across for every row: the `Taps` of each axis. Those are near each other, so a row of a picture is a small dense matrix
times the rows of the sheet that it needs. A dense matrix has zeros in it and is still quicker than the
sparse one of scipy (`make bench`); and many pictures are made from a band of rows while it is in the cache.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise, product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.lightfield.sheet.interpolation import Light

BAND_BYTES = 96 * 2**20
"""About so much of the sheet is worked on at a time, and half of it more."""

PRODUCT_ROWS = 8
"""Matrices of so many rows make the best of a processor without too many zeros."""

CACHED_COLS = 1024
"""Cols of a band that are summed down and across while they are in a processor's cache."""

PRODUCT_COLS = 10
"""Picture columns of one product across."""

_SINGLES = np.arange(2**16, dtype=np.uint16).view(np.float16).astype(np.float32)
"""The number of every half float, by its bits."""


@dataclass(frozen=True)
class Taps:
    """The weights of the sheet's pixels in those of a picture, along one axis: three arrays, by rising `made`."""

    pixels: int
    """The pixels of the picture along the axis."""
    made: NDArray[np.intp]
    """The picture's pixel."""
    taken: NDArray[np.intp]
    """The sheet's; none twice for the same pixel of the picture."""
    weight: NDArray[np.float64]

    def within(self, start: int, stop: int) -> Taps:
        """Return the taps of some pixels of the picture, renumbered from 0.

        Parameters
        ----------
        start, stop
            The pixels [start, stop) of the picture.
        """
        some = slice(*np.searchsorted(self.made, (start, stop)))
        return Taps(stop - start, self.made[some] - start, self.taken[some], self.weight[some])

    def shares(self) -> Taps:
        """Return the taps with weights normalised to a sum of 1 for every pixel of the picture."""
        total = np.bincount(self.made, self.weight, minlength=self.pixels)
        return Taps(self.pixels, self.made, self.taken, self.weight / total[self.made])


def taps(made: NDArray[np.intp], taken: NDArray[np.intp], weight: NDArray[np.float64], *, pixels: int) -> Taps:
    """Sort taps by the picture's pixel, without those of no weight.

    Parameters
    ----------
    made, taken
        The pixels of the picture and of the sheet, of one shape, in any order.
    weight
        The weights, of the same shape.
    pixels
        The pixels of the picture along the axis.
    """
    has = weight != 0
    order = np.argsort(made[has], kind="stable")
    return Taps(pixels, made[has][order], taken[has][order], weight[has][order])


def weighted_sums(light: NDArray[Light], down: Sequence[Taps], across: Sequence[Taps]) -> NDArray[np.floating[Any]]:
    """Compute pictures whose pixels are weighted sums of those of a sheet.

    Parameters
    ----------
    light
        The sheet `(rows, cols, channel)`, linear light.
    down, across
        For every picture, its taps among the sheet's rows and among its cols; all of one size.

    Returns
    -------
    NDArray
        `(picture, row, col, channel)`, in single precision or the sheet's, if higher. Of every pixel, the sum over its
        taps down and across of weight times weight times light.

    Notes
    -----
    In a product with zeros, a pixel that is no number or infinite makes those near it no numbers either.
    """
    dtype = np.result_type(light.dtype, np.float32)
    rows = down[0].pixels
    made = np.zeros((len(down), rows, light.shape[2], across[0].pixels), dtype=dtype)
    blocks = [_Block(slice(*edges), across, dtype) for edges in pairwise(_edges(light.shape[1], CACHED_COLS))]
    groups = _alike(down)
    for start, stop in pairwise(_edges(rows, _band_rows(light, rows, dtype))):
        here = [one.within(start, stop) for one in down]
        taken = np.concatenate([one.taken for one in here])
        if not taken.size:
            continue
        first = int(taken.min())
        band = planes(light[first : int(taken.max()) + 1])
        for group in groups:
            some = [here[index] for index in group]
            products = list(_stacked(some, max(1, PRODUCT_ROWS // len(some)), dtype))
            for (channel, plane), block in product(enumerate(band), blocks):
                summed = _down(plane[:, block.cols], first, products, pictures=len(some), rows=stop - start)
                for index, part in zip(group, summed, strict=True):
                    block.across(part, index, made[index, start:stop, channel])
    return made.transpose(0, 1, 3, 2)


def planes(light: NDArray[Light]) -> NDArray[np.floating[Any]]:
    """Return `(row, col, channel)` as `(channel, row, col)`, in single precision or its own, if higher.

    Half floats are looked up in a table, which is quicker than a cast of pixels that are not side by side.
    """
    rows, cols, channels = light.shape
    if light.dtype != np.float16:
        return light.transpose(2, 0, 1).astype(np.result_type(light.dtype, np.float32), order="C")
    out, bits = np.empty((channels, rows, cols), dtype=np.float32), light.view(np.uint16)
    for row, channel in np.ndindex(rows, channels):
        _SINGLES.take(bits[row, :, channel], out=out[channel, row], mode="clip")
    return out


@dataclass(frozen=True)
class _Product:
    """Some pixels of pictures as a matrix times some pixels of the sheet."""

    made: slice
    taken: slice
    weights: NDArray[np.floating[Any]]
    """`(made, taken)`; for several pictures, one after the other's."""


def _down(
    plane: NDArray[np.floating[Any]], first: int, products: Sequence[_Product], *, pictures: int, rows: int
) -> NDArray[np.floating[Any]]:
    """Return rows of pictures summed down only, `(picture, row, col of the sheet)`.

    `plane` is one channel and some cols of the sheet from row `first` on.
    """
    summed = np.zeros((pictures, rows, plane.shape[1]), dtype=plane.dtype)
    for one in products:
        some = one.weights @ plane[one.taken.start - first : one.taken.stop - first]
        summed[:, one.made] = some.reshape(pictures, -1, plane.shape[1])
    return summed


class _Block:
    """Some cols of the sheet, and what they add to every picture."""

    def __init__(self, cols: slice, across: Sequence[Taps], dtype: np.dtype[Any]) -> None:
        self.cols = cols
        self._products = [list(self._own(one, dtype)) for one in across]

    def _own(self, across: Taps, dtype: np.dtype[Any]) -> Iterator[_Product]:
        for one in _stacked([across], PRODUCT_COLS, dtype):
            left, right = max(self.cols.start, one.taken.start), min(self.cols.stop, one.taken.stop)
            if left < right:
                weights = one.weights[:, left - one.taken.start : right - one.taken.start]
                yield _Product(one.made, slice(left - self.cols.start, right - self.cols.start), weights)

    def across(self, part: NDArray[np.floating[Any]], picture: int, made: NDArray[np.floating[Any]]) -> None:
        """Add to rows of a picture what these cols of the sheet, summed down, make of it."""
        for one in self._products[picture]:
            made[:, one.made] += part[:, one.taken] @ one.weights.T


def _stacked(several: Sequence[Taps], step: int, dtype: np.dtype[Any]) -> Iterator[_Product]:
    """Yield what makes `step` pixels at a time of several pictures, where there is anything."""
    pixels = several[0].pixels
    low = np.full(-(-pixels // step), np.iinfo(np.intp).max)
    high = np.full(low.size, -1)
    for one in several:
        np.minimum.at(low, one.made // step, one.taken)
        np.maximum.at(high, one.made // step, one.taken)
    any_there = high >= low
    weights = np.zeros((low.size, len(several), step, int((high - low)[any_there].max(initial=0)) + 1), dtype=dtype)
    for picture, one in enumerate(several):
        group, pixel = np.divmod(one.made, step)
        weights[group, picture, pixel, one.taken - low[group]] = one.weight
    for number in np.flatnonzero(any_there).tolist():
        made = slice(number * step, min(pixels, (number + 1) * step))
        taken = slice(int(low[number]), int(high[number]) + 1)
        some = weights[number, :, : made.stop - made.start, : taken.stop - taken.start]
        yield _Product(made, taken, some.reshape(-1, taken.stop - taken.start))


def _alike(down: Sequence[Taps]) -> list[list[int]]:
    """Return groups of pictures that reach about as far, so that they need about the same rows."""
    reach = [float(np.ptp(one.taken - one.made * (int(one.taken.max()) / one.pixels))) for one in down]
    order = sorted(range(len(down)), key=reach.__getitem__)
    return [order[start : start + PRODUCT_ROWS] for start in range(0, len(order), PRODUCT_ROWS)]


def _band_rows(light: NDArray[Any], rows: int, dtype: np.dtype[Any]) -> int:
    """Return the picture rows of a band."""
    row_bytes = light.shape[1] * light.shape[2] * dtype.itemsize
    return max(1, int(BAND_BYTES / row_bytes * rows / light.shape[0]))


def _edges(length: int, step: int) -> list[int]:
    return [*range(0, length, step), length]
