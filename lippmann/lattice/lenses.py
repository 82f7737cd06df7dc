"""An array of lenses: where its lenses stand, which of them is nearest to a place, and how large it is.

The middle of the array is the origin, right and down are positive. All lengths are in the unit of the pitch: with a
pitch of 1 they are in pitches, with a pitch in mm they are in mm.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.lattice.arrays import NUMPY, Arrays
from lippmann.lattice.cell import Cell, Lattice, Nearest, Ties
from lippmann.lattice.kinds import CELLS


@dataclass(frozen=True)
class LensLattice:
    """An array of lenses of one pitch."""

    lens_rows: int
    lens_cols: int
    kind: Lattice = "square"
    first_row_shifted: bool = False
    """Hexagonal: the even lens rows are the ones that stand half a pitch further right, not the odd ones."""
    pitch: float = 1.0
    """The distance of neighbouring lenses of a row, in any unit."""

    @property
    def cell(self) -> Cell:
        """The shape of a lens's cell."""
        return CELLS[self.kind]

    @property
    def row_pitch(self) -> float:
        """The distance of neighbouring lens rows."""
        return self.pitch * self.cell.row_pitch

    @property
    def extent(self) -> tuple[float, float]:
        """The (height, width) of the array, from its outermost border or corner to the opposite one.

        >>> LensLattice(90, 90).extent
        (90.0, 90.0)
        """
        high = (self.lens_rows + self.cell.overhang) * self.cell.row_pitch
        return high * self.pitch, (self.lens_cols + self._width_of_shift) * self.pitch

    @property
    def span(self) -> tuple[float, float]:
        """The (height, width) between the centres of the outermost lenses.

        >>> LensLattice(3, 4, "hexagonal", pitch=2.0).span[1]
        7.0
        """
        high = (self.lens_rows - 1) * self.cell.row_pitch
        return high * self.pitch, (self.lens_cols - 1 + self._width_of_shift) * self.pitch

    @property
    def _width_of_shift(self) -> float:
        """The width that the shifted lens rows add, in pitches."""
        return self.cell.row_shift if self.lens_rows > 1 else 0.0

    def row_middle_pitches(self, lens_row: int) -> float:
        """Return how far to the right of the array's middle the middle of a lens row stands, in pitches."""
        return self.cell.shift(lens_row, first_row_shifted=self.first_row_shifted) - self._width_of_shift / 2

    def centres(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the centres of all lenses as (right, down), each `(lens_row, lens_col)` float64.

        >>> LensLattice(2, 2, "hexagonal").centres()[0]
        array([[-0.75,  0.25],
               [-0.25,  0.75]])
        """
        rows, cols = np.arange(self.lens_rows)[:, np.newaxis], np.arange(self.lens_cols)
        right, down = self.centre_of(rows, cols)
        return right, np.broadcast_to(down, right.shape).copy()

    def centre_of(self, lens_row: Any, lens_col: Any, *, xp: Arrays = NUMPY) -> tuple[Any, Any]:
        """Return the centres of some lenses as (right, down); the lattice goes on beyond the array.

        Parameters
        ----------
        lens_row, lens_col
            The numbers of the lenses, integers that broadcast with each other.
        xp
            The library of the arrays.

        Returns
        -------
        tuple
            `right` of the common shape and `down` of the shape of `lens_row`, float64 in the unit of the pitch.
        """
        middle = xp.where((lens_row & 1) == 1, self.row_middle_pitches(1), self.row_middle_pitches(0))
        right = (xp.real(lens_col) - (self.lens_cols - 1) / 2) * self.pitch + middle * self.pitch
        return right, (xp.real(lens_row) - (self.lens_rows - 1) / 2) * self.row_pitch

    def nearest(self, right: Any, down: Any, *, ties: Ties = "right", xp: Arrays = NUMPY) -> Nearest:
        """Return the lens that each place is nearest to; the lattice goes on beyond the array, see `has`.

        With the ties to the right, of two lenses in a row that are as near it is the right one; of two lens rows, the
        lower one of squares and the upper one of hexagons.

        Parameters
        ----------
        right, down
            The places from the middle of the array, float64 that broadcast with each other, in the unit of the pitch.
        ties
            Which of two equally near lenses is taken.
        xp
            The library of the arrays.

        Returns
        -------
        Nearest
            The lenses, and the places from their centres in the unit of the pitch; on the square lattice rows have
            the shape of `down` and columns that of `right`.
        """
        found = self.cell.nearest(self, right / self.pitch, down / self.pitch, ties=ties, xp=xp)
        return Nearest(found.lens_row, found.lens_col, right=found.right * self.pitch, down=found.down * self.pitch)

    def has(self, lens_row: NDArray[np.intp], lens_col: NDArray[np.intp]) -> NDArray[np.bool_]:
        """Return which lenses of the endless lattice the array has.

        Parameters
        ----------
        lens_row, lens_col
            The numbers of the lenses, integers that broadcast with each other.

        Returns
        -------
        NDArray
            bool of the common shape.
        """
        has_row = (lens_row >= 0) & (lens_row < self.lens_rows)
        return np.asarray(has_row & (lens_col >= 0) & (lens_col < self.lens_cols))

    def contains(self, right: Any, down: Any, *, tolerance: float = 0.0, xp: Arrays = NUMPY) -> Any:
        """Return which places lie in the cell of a lens, its border included.

        Parameters
        ----------
        right, down
            The places from the **centre of the lens**, float64 that broadcast with each other, in the unit of the
            pitch.
        tolerance
            The part of the cell's size by which places may lie beyond its border.
        xp
            The library of the arrays.

        Returns
        -------
        Any
            bool of the common shape.
        """
        return self.cell.border_distance(right / self.pitch, down / self.row_pitch, xp) <= 1 + tolerance

    def lens_rows_near(self, down: NDArray[np.float64]) -> tuple[int, int]:
        """Return [first, stop) of the lens rows of the array whose cells places at these heights may lie in.

        Parameters
        ----------
        down
            The heights from the middle of the array, float64 of any shape, at least one, in the unit of the pitch.

        Returns
        -------
        tuple
            The first lens row and the one after the last; at least one lens row, even for heights beyond the array.
        """
        low, high = self.cell.rows_near(down / self.pitch, self.lens_rows)
        first, last = (int(np.clip(row, 0, self.lens_rows - 1)) for row in (low, high))
        return first, last + 1
