"""The cell of one lens: what the square and the hexagonal lattice have to answer.

Lengths are in lens pitches unless a name says otherwise, to the right and downward. The square cell stands on a side.
The hexagonal cell stands on a corner, and every second lens row is shifted by half a pitch.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from lippmann.lattice.arrays import NUMPY, Arrays

if TYPE_CHECKING:
    from lippmann.lattice.lenses import LensLattice

Lattice = Literal["square", "hexagonal"]
"""The kind of a lattice."""

ON_THE_BORDER = 1e-9
"""A place that is this close to a border between lenses, in pitches, lies on the border."""


Ties = Literal["right", "even"]
"""The rule for a place between two equally near lenses of a row. `right` takes the right lens, to within
`ON_THE_BORDER`; `even` takes the lens with the even number, so that both sides share the places on borders."""


@dataclass(frozen=True)
class Nearest:
    """The lenses of an endless lattice that places are nearest to; the arrays broadcast with each other."""

    lens_row: NDArray[np.intp]
    lens_col: NDArray[np.intp]
    right: NDArray[np.float64]
    """The place's distance to the right of the lens's centre, in the unit of the lattice's pitch."""
    down: NDArray[np.float64]
    """The place's distance below the lens's centre, in the unit of the lattice's pitch."""


class Cell(ABC):
    """The shape of a cell, and how cells stand together."""

    kind: ClassVar[Lattice]
    row_pitch: ClassVar[float]
    """The distance of neighbouring lens rows, in pitches."""
    row_shift: ClassVar[float]
    """The distance by which every second lens row is shifted, in pitches."""
    row_period: ClassVar[int]
    """The number of lens rows after which the lattice repeats; the number of px across a lens is a multiple of it."""
    corners: ClassVar[tuple[tuple[float, float], ...]]
    """The corners of the cell on its right side, (right, down) from its centre, in (pitches, row pitches)."""
    corner_radius: ClassVar[float]
    """The distance from the centre of the cell to its corners, in pitches."""
    overhang: ClassVar[float]
    """The height by which the cells of a lens row reach beyond it, above and below together, in row pitches."""
    plural: ClassVar[str]
    """The words for several such lenses in a message."""

    @property
    def half_height(self) -> float:
        """The distance from the centre of the cell to its upper end, in pitches."""
        return max(down for _, down in self.corners) * self.row_pitch

    def shift(self, lens_row: int, *, first_row_shifted: bool = False) -> float:
        """Return how far to the right of the leftmost lens rows a lens row stands.

        Parameters
        ----------
        lens_row
            The number of the lens row, any whole number.
        first_row_shifted
            True if the even lens rows are the shifted ones.

        Returns
        -------
        float
            The shift, pitches.
        """
        return self.row_shift if lens_row % 2 != first_row_shifted else 0.0

    @abstractmethod
    def border_distance(self, right: Any, down: Any, xp: Arrays = NUMPY) -> Any:
        """Return how far from the centre towards the border of the cell places lie: 0 at the centre, 1 on the border.

        Parameters
        ----------
        right
            The distances to the right of the centre, float64 of any shape, pitches.
        down
            The distances below the centre, float64 of a shape that broadcasts with `right`, **row pitches**.
        xp
            The library of the arrays.

        Returns
        -------
        Any
            float64 of the common shape.
        """

    @abstractmethod
    def owns(self, right: NDArray[np.float64], down: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return which places belong to the cell, so that every place of the plane belongs to exactly one cell.

        A place on the border belongs to the lens that `LensLattice.nearest` names: of two lenses in a row the right
        one, of two lens rows the lower one of squares and the upper one of hexagons.

        Parameters
        ----------
        right
            The distances to the right of the centre, float64 of any shape, pitches.
        down
            The distances below the centre, float64 of a shape that broadcasts with `right`, **row pitches**.

        Returns
        -------
        NDArray
            bool of the common shape.
        """

    @abstractmethod
    def nearest(self, lenses: LensLattice, right: Any, down: Any, *, ties: Ties, xp: Arrays = NUMPY) -> Nearest:
        """Return the lenses that places are nearest to; see `LensLattice.nearest`.

        Parameters
        ----------
        lenses
            The array, whose lattice goes on beyond its borders.
        right, down
            The places from the middle of the array, float64 that broadcast with each other, **pitches**.
        ties
            Which of two lenses that are equally near is taken.
        xp
            The library of the arrays.

        Returns
        -------
        Nearest
            The distances from the centres are in pitches.
        """

    @abstractmethod
    def rows_near(self, down: NDArray[np.float64], lens_rows: int) -> tuple[int, int]:
        """Return the first and the last lens row of the endless lattice in whose cells places may lie.

        Parameters
        ----------
        down
            The heights from the middle of the array, float64 of any shape, pitches.
        lens_rows
            The number of lens rows of the array.
        """

    @abstractmethod
    def row_px(self, px_per_lens: int) -> int:
        """Return the pixel rows from one lens row to the next, for so many pixels across a lens."""

    @abstractmethod
    def overhang_px(self, row_px: int) -> int:
        """Return the pixel rows by which a cell reaches into the next lens row, for so many px from row to row."""

    @abstractmethod
    def mask(self, *, px_per_lens: int, row_px: int, overhang_px: int) -> NDArray[np.bool_]:
        """Return which pixels of the box round a cell have their centre in the cell.

        Parameters
        ----------
        px_per_lens
            The pixels across a lens, n.
        row_px
            The pixel rows from one lens row to the next, m.
        overhang_px
            The pixel rows of the box above those m rows, and as many below.

        Returns
        -------
        NDArray
            `(cell_row, cell_col)` bool, read-only; it is the same when turned by 180 degrees or mirrored.
        """


def nearest_number(number: Any, ties: Ties, xp: Arrays = NUMPY) -> Any:
    """Return the integer nearest to each number of a lens.

    Parameters
    ----------
    number
        Numbers of lenses along a row, with fractions between them, float64 of any shape.
    ties
        Which of two equally near integers is taken.
    xp
        The library of the arrays.

    Returns
    -------
    Any
        Integers of the same shape; intp of NumPy.
    """
    return xp.whole(xp.round(number) if ties == "even" else xp.floor(number + 0.5 + ON_THE_BORDER))
