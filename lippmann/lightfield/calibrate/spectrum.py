"""The spectrum of the evidence of lenses, and the lines that stand out from it.

A wave that goes through the whole picture is a line: no broader than the picture allows. What is shown spreads.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.lightfield.calibrate.phases import Wave, from_middle

LARGEST_PX = 3000
"""The largest part of each side that is used, in the middle, px."""

LINE_PX, AROUND_PX = 7, 17
"""Squares of the spectrum: what a line fills, and about it what it is compared with."""

BY_CHANCE, BEYOND_DOUBT = 6.0, 400.0
"""Power of a line by that about it: from 0 to 1 its logarithm counts as to be seen."""

LINES = 40
"""The strongest lines on each axis that are tried."""

TURNED_DEG = 10.0
"""The largest rotation of the rows, degrees."""

NYQUIST = 0.46
"""Waves a pixel up to which lines are looked for."""

MASK_PX = 2
"""The distance from a line, in the spectrum, to which nothing is seen once the line is explained."""

_Numbers = NDArray[np.float64]


@dataclass(frozen=True)
class Spectrum:
    """The spectrum of a picture's evidence."""

    power: NDArray[np.float32]
    """Logarithms, `(row, col)`, zero frequency in the middle."""
    light: NDArray[np.complex64]
    """The amplitudes."""
    above: NDArray[np.float32]
    """The contrast of each line with its neighbours, 0 to 1."""
    nearby: NDArray[np.float32]
    """The most of `above` within a pixel."""
    masked: NDArray[np.bool_]
    """True where lines are explained by something else than lenses."""
    middle_px: _Numbers
    """The middle of the part of the picture that is used, (right, down) from the picture's top left corner."""

    @property
    def size(self) -> _Numbers:
        """(cols, rows)."""
        return np.array(self.power.shape[::-1])

    def at(self, number: _Numbers) -> NDArray[np.intp]:
        """Return the (col, row) of waves a pixel, `(.., (right, down))`."""
        at: NDArray[np.intp] = np.round(number * self.size + self.size // 2).astype(np.intp)
        return at

    def has_room(self, numbers: _Numbers) -> NDArray[np.bool_]:
        """Return at which waves `(wave, (right, down))` a line could be seen."""
        room: NDArray[np.bool_] = np.abs(numbers).max(axis=1) < NYQUIST
        col, row = self.at(np.where(room[:, np.newaxis], numbers, 0)).T
        room &= ~self.masked[row, col]
        return room

    def line(self, number: _Numbers) -> Wave | None:
        """Return the line within a pixel of a wave (right, down), if there is one to be seen."""
        if not self.has_room(number[np.newaxis])[0]:
            return None
        col, row = self.at(number)
        around = self.power[row - 1 : row + 2, col - 1 : col + 2]
        below, beside = np.unravel_index(np.argmax(around), around.shape)
        row, col = row - 1 + below, col - 1 + beside
        clear = float(self.above[row, col])
        if clear <= 0:
            return None
        # Where the window is about the middle, the phase there is the same all over a line.
        return Wave(self._summit(int(col), int(row)), clear, self._phase(int(col), int(row)))

    def peaks(self, axis: int) -> _Numbers:
        """Return the clearest lines near an axis, 0 level and 1 upright, as waves a pixel `(line, (right, down))`."""
        rows, cols = np.nonzero((self.above > 0) & (self.above >= self.nearby) & ~self.masked)
        number = (np.stack((cols, rows), axis=-1) - self.size // 2) / self.size
        aslant = math.tan(math.radians(TURNED_DEG))
        near = (number[:, axis] > np.abs(number[:, 1 - axis]) / aslant) & (number[:, axis] < NYQUIST)
        rows, cols = rows[near], cols[near]
        clearest = np.argsort(-(self.above[rows, cols] + 1e-3 * self.power[rows, cols]))[:LINES]
        return np.array([self._summit(int(cols[one]), int(rows[one])) for one in clearest]).reshape(-1, 2)

    def without(self, numbers: Iterable[_Numbers]) -> Spectrum:
        """Return the spectrum without the lines of waves, each (right, down)."""
        masked = self.masked.copy()
        for number in numbers:
            col, row = self.at(number)
            masked[
                max(0, row - MASK_PX) : max(0, row + MASK_PX + 1), max(0, col - MASK_PX) : max(0, col + MASK_PX + 1)
            ] = True
        kept = ~masked
        return replace(self, above=self.above * kept, nearby=self.nearby * kept, masked=masked)

    def _phase(self, col: int, row: int) -> float:
        """Return the phase in the middle of the part that is used."""
        rows, cols = self.power.shape
        turns = (row - rows // 2) / rows * (rows - 1) / 2 + (col - cols // 2) / cols * (cols - 1) / 2
        return float(np.angle(self.light[row, col]) + 2 * math.pi * turns)

    def _summit(self, col: int, row: int) -> _Numbers:
        """Return where between pixels a line is highest, as waves a pixel."""
        rows, cols = self.power.shape
        row, col = min(max(row, 1), rows - 2), min(max(col, 1), cols - 2)
        place = []
        for at, line in ((col, self.power[row, col - 1 : col + 2]), (row, self.power[row - 1 : row + 2, col])):
            place.append(at + _between(*(float(value) for value in line)))
        summit: _Numbers = (np.array(place) - self.size // 2) / self.size
        return summit


def _between(before: float, here: float, after: float) -> float:
    """Return where a wave is between the bins of a Hann window's spectrum, by the logarithms of power of three bins.

    The amplitudes of a wave at bins j and j + 1, if it is at j + d, have the ratio (1 + d) / (2 - d) (V. K. Jain,
    W. L. Collins, D. C. Davis, *High-accuracy analog measurements via interpolated FFT*, IEEE Trans. Instrum. Meas. 28,
    1979, for the Hann window).

    >>> round(_between(-9.0, 0.0, 0.0), 3), round(_between(0.0, 2 * math.log(2), 0.0), 3)
    (0.5, 0.0)
    """
    ratio = math.exp((max(before, after) - here) / 2)
    away = float(np.clip((2 * ratio - 1) / (1 + ratio), 0.0, 0.5))
    return away if after >= before else -away


def spectrum_of(evidence: NDArray[np.floating[Any]]) -> Spectrum:
    """Return the spectrum of the middle of the evidence `(rows, cols)`."""
    from scipy.fft import fft2, fftshift
    from scipy.ndimage import maximum_filter, uniform_filter

    rows, cols = (_middle(side) for side in evidence.shape)
    field = evidence[rows, cols].astype(np.float32, copy=False)
    tapers = [(np.cos(math.pi * from_middle(side) / side) ** 2).astype(np.float32) for side in field.shape]
    light = fftshift(fft2((field - field.mean()) * np.outer(*tapers)))
    power = np.log(light.real**2 + light.imag**2 + np.finfo(np.float32).tiny)
    inner, outer = (uniform_filter(power, side, mode="wrap") * np.float32(side**2) for side in (LINE_PX, AROUND_PX))
    about = (outer - inner) / np.float32(AROUND_PX**2 - LINE_PX**2)
    low, high = math.log(BY_CHANCE), math.log(BEYOND_DOUBT)
    above = np.clip((power - about - np.float32(low)) / np.float32(high - low), 0, 1)
    middle = np.array([part.start + part.stop for part in (cols, rows)]) / 2
    return Spectrum(power, light, above, maximum_filter(above, 3), np.zeros(power.shape, dtype=np.bool_), middle)


def _middle(side: int) -> slice:
    """Return the middle of a side that is used: as many pixels as have small factors."""
    from scipy.fft import prev_fast_len

    part = prev_fast_len(min(side, LARGEST_PX))
    start = (side - part) // 2
    return slice(start, start + part)
