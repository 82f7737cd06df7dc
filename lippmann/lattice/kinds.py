"""The one place that chooses between the square and the hexagonal lattice."""

from __future__ import annotations

from lippmann.lattice.cell import Cell, Lattice
from lippmann.lattice.hexagonal import HexagonalCell
from lippmann.lattice.square import SquareCell

CELLS: dict[Lattice, Cell] = {"square": SquareCell(), "hexagonal": HexagonalCell()}
"""The cell of each kind of lattice."""
