"""Blocks of views around the middle one: the views that go into a data set."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from pydantic import Field

from lippmann.job.fields.problems import FieldError
from lippmann.job.optics.rig import Rig

ViewCount = tuple[
    Annotated[int, Field(ge=1, le=1024, title="Down")], Annotated[int, Field(ge=1, le=1024, title="Across")]
]
"""The number of views as (rows, cols): down and across."""


@dataclass(frozen=True)
class ViewBlock:
    """A block of views `(first_u + u, first_v + v)`, with u < cols and v < rows."""

    first_v: int
    first_u: int
    rows: int
    cols: int

    @property
    def middle(self) -> int:
        """The number, counted row by row, of the view nearest the axes of the lenses; see `views.centre`."""
        return self.rows // 2 * self.cols + self.cols // 2

    @property
    def numbers(self) -> tuple[tuple[int, int], ...]:
        """The (u, v) of every view of the block, row by row."""
        rows, cols = range(self.first_v, self.first_v + self.rows), range(self.first_u, self.first_u + self.cols)
        return tuple((u, v) for v in rows for u in cols)


def all_views(rig: Rig) -> ViewBlock:
    """Return the block of all views; on the hexagonal lattice the views at its corners do not exist.

    >>> all_views(Rig())
    ViewBlock(first_v=0, first_u=0, rows=8, cols=8)
    """
    return ViewBlock(0, 0, rig.layout.cell_rows, rig.layout.cell_cols)


def block_about_the_middle(rig: Rig, views: tuple[int, int]) -> ViewBlock:
    """Return the block of (rows, cols) views around the middle view of a lens.

    >>> block_about_the_middle(Rig(), (5, 4))
    ViewBlock(first_v=2, first_u=2, rows=5, cols=4)
    """
    box = all_views(rig)
    return ViewBlock(box.rows // 2 - views[0] // 2, box.cols // 2 - views[1] // 2, *views)


def all_views_exist(rig: Rig, block: ViewBlock) -> bool:
    """Return True if every view of a block has its pixel under the lens."""
    rows, cols = slice(block.first_v, block.first_v + block.rows), slice(block.first_u, block.first_u + block.cols)
    return bool(rig.layout.mask[rows, cols].all())


def check_view(field: str, rig: Rig, view: tuple[int, int]) -> None:
    """Refuse a view that does not exist.

    Parameters
    ----------
    field
        The option that names the view.
    rig
        The rig whose lenses have the views.
    view
        The view (u, v).

    Raises
    ------
    FieldError
        Naming the field.
    """
    layout, (u, v) = rig.layout, view
    if not layout.has_view(u, v):
        expected = f"a view from (0, 0) to ({layout.cell_cols - 1}, {layout.cell_rows - 1})"
        there = layout.views_in_row(v)
        if there and u < layout.cell_cols:
            expected = f"a view with u from {there[0]} to {there[-1]}, which exist in row {v} of the views"
        elif v < layout.cell_rows and not there:
            rows = layout.rows_of_views
            expected = f"a view with v from {rows[0]} to {rows[-1]}, the rows in which there are views"
        raise FieldError(field, expected=expected, got=f"({u}, {v})")


def largest_odd_square(rig: Rig) -> ViewBlock:
    """Return the largest square block with an odd side whose views all exist.

    >>> largest_odd_square(Rig())
    ViewBlock(first_v=1, first_u=1, rows=7, cols=7)
    """
    box = all_views(rig)
    squares = (block_about_the_middle(rig, (side, side)) for side in range(1, min(box.rows, box.cols) + 1, 2))
    return [square for square in squares if all_views_exist(rig, square)][-1]


def check_block(rig: Rig, views: tuple[int, int], *, wholly: bool) -> None:
    """Refuse more views than a lens has, and missing views if the format cannot have gaps (`wholly`).

    Raises
    ------
    FieldError
        The error names the option `views`.
    """
    box = all_views(rig)
    got = f"{views[0]} x {views[1]}"
    if views[0] > box.rows or views[1] > box.cols:
        raise FieldError("views", expected=f"at most {box.rows} x {box.cols} views, pixels under a lens", got=got)
    if wholly and not all_views_exist(rig, block_about_the_middle(rig, views)):
        most = largest_odd_square(rig)
        expected = f"views that all exist under a hexagonal lens, as {most.rows} x {most.cols}"
        raise FieldError("views", expected=expected, got=got)
