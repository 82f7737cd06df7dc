"""Sheets larger than memory, processed in bands of lens rows; the result equals that of the whole sheet.

`Rows` is a picture in memory or on disk. A `Sheet` has a layout as well, and yields the pixel rows of some lens rows,
which `part_layout` and `part_rows` give. Square cells of two bands share no pixel rows. Hexagons reach into the
lens rows above and below, so neighbouring bands share rows, of which each band needs to hold only what is under its own
lenses; `stitched` puts them together.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from lippmann.lattice.layout import CellLayout, check_size
from lippmann.lightfield.sheet.orthoscopic import orthoscopic, orthoscopic_layout
from lippmann.lightfield.views.views import views_grid


class Rows(Protocol):
    """A picture whose rows can be read."""

    @property
    def rows(self) -> int:
        """Height, px."""

    @property
    def cols(self) -> int:
        """Width, px."""

    def read(self, start: int, stop: int) -> NDArray[Any]:
        """Return some pixel rows, `(rows, cols, channel)`.

        Parameters
        ----------
        start, stop
            The pixel rows [start, stop).
        """


@dataclass(frozen=True)
class HeldRows:
    """A picture in memory."""

    pixels: NDArray[Any]
    """`(rows, cols, channel)`."""

    @property
    def rows(self) -> int:
        """Height, px."""
        return len(self.pixels)

    @property
    def cols(self) -> int:
        """Width, px."""
        return len(self.pixels[0])

    def read(self, start: int, stop: int) -> NDArray[Any]:
        """Return pixel rows as a view of the memory of the picture; see `Rows.read`."""
        return self.pixels[start:stop]


class Sheet(Protocol):
    """An integral image whose lens rows can be read."""

    @property
    def layout(self) -> CellLayout:
        """The layout of the whole sheet."""

    def part(self, first: int, stop: int) -> NDArray[Any]:
        """Return the pixel rows of some lens rows, `(rows, cols, channel)`; see `part_rows`.

        Pixels that are not under a lens of these rows may have any value that the sheet has there, or zero.

        Parameters
        ----------
        first, stop
            The lens rows [first, stop).
        """


@dataclass(frozen=True)
class SheetOfRows:
    """A picture and the lenses over it."""

    picture: Rows
    layout: CellLayout

    def __post_init__(self) -> None:
        """Refuse pixels that do not divide among the lenses."""
        check_size(self.picture.rows, self.picture.cols, self.layout)

    def part(self, first: int, stop: int) -> NDArray[Any]:
        """Return the pixel rows of some lens rows; see `Sheet.part`."""
        return self.picture.read(*part_rows(self.layout, first, stop))


@dataclass(frozen=True)
class OrthoscopicSheet:
    """The orthoscopic integral image of a captured sheet; see `orthoscopic`."""

    captured: Sheet
    inverted: bool
    """True if an imaging lens turned the picture upside down."""

    @property
    def layout(self) -> CellLayout:
        """The layout of the orthoscopic sheet."""
        return orthoscopic_layout(self.captured.layout, inverted=self.inverted)

    def part(self, first: int, stop: int) -> NDArray[Any]:
        """Return the pixel rows of some lens rows, zero outside their lenses; see `Sheet.part`."""
        rows = self.layout.lens_rows
        first_captured, stop_captured = (rows - stop, rows - first) if self.inverted else (first, stop)
        wide_first, wide_stop = at_least_two(self.captured.layout, first_captured, stop_captured)
        turned = orthoscopic(
            self.captured.part(wide_first, wide_stop),
            part_layout(self.captured.layout, wide_first, wide_stop),
            inverted=self.inverted,
        )
        above = (wide_stop - stop_captured if self.inverted else first_captured - wide_first) * self.layout.row_px
        start, end = part_rows(self.layout, first, stop)
        return turned[above : above + end - start]


@dataclass(frozen=True)
class TurnedSheet:
    """A sheet turned by 180 degrees in its plane; see `turn_sheet`."""

    sheet: Sheet

    @property
    def layout(self) -> CellLayout:
        """The layout of the turned sheet."""
        return self.sheet.layout.turned()

    def part(self, first: int, stop: int) -> NDArray[Any]:
        """Return the pixel rows of some lens rows; see `Sheet.part`."""
        rows = self.layout.lens_rows
        return self.sheet.part(rows - stop, rows - first)[::-1, ::-1]


def part_layout(layout: CellLayout, first: int, stop: int) -> CellLayout:
    """Return the layout of some lens rows alone; of a hexagonal array of several rows, they are at least two.

    Parameters
    ----------
    layout
        The layout of the whole.
    first, stop
        The lens rows [first, stop).
    """
    return replace(layout, lens_rows=stop - first, first_row_shifted=layout.shift_px(first) > 0)


def part_rows(layout: CellLayout, first: int, stop: int) -> tuple[int, int]:
    """Return the pixel rows [start, stop) over which some lens rows reach.

    Parameters
    ----------
    layout
        The layout of the whole.
    first, stop
        The lens rows [first, stop).

    Examples
    --------
    >>> part_rows(CellLayout(5, 1, 8, "hexagonal"), 1, 3)
    (7, 25)
    """
    return first * layout.row_px, stop * layout.row_px + 2 * layout.overhang_px


def bands(layout: CellLayout, band_px: int) -> tuple[tuple[int, int], ...]:
    """Cut an array into bands of lens rows [first, stop), top down; every lens row is in one band.

    A band of a hexagonal array of several lens rows has at least two, so that it knows which of them are shifted.

    Parameters
    ----------
    layout
        The layout of the whole.
    band_px
        The approximate number of pixels of a band.

    Examples
    --------
    >>> bands(CellLayout(5, 4, 8), band_px=600)
    ((0, 2), (2, 4), (4, 5))
    >>> bands(CellLayout(5, 4, 8, "hexagonal"), band_px=600)
    ((0, 2), (2, 5))
    """
    least = layout.cell.row_period
    step = max(least, band_px // (layout.row_px * layout.cols))
    firsts = [*range(0, layout.lens_rows, step)]
    if len(firsts) > 1 and layout.lens_rows - firsts[-1] < least:
        firsts.pop()
    return tuple(zip(firsts, [*firsts[1:], layout.lens_rows], strict=True))


def stitched(sheet: Sheet, band_px: int) -> Iterator[NDArray[Any]]:
    """Yield the pixel rows of a sheet, top down, each once, in bands.

    Parameters
    ----------
    sheet
        The sheet.
    band_px
        The approximate number of pixels of a band.

    Yields
    ------
    NDArray
        `(rows, cols, channel)`, in the dtype of the sheet.
    """
    layout, waiting = sheet.layout, None
    shared = 2 * layout.overhang_px
    for first, stop in bands(layout, band_px):
        pixels = sheet.part(first, stop)
        if waiting is not None:
            pixels = _over(pixels, waiting)
        ready = len(pixels) - (shared if stop < layout.lens_rows else 0)
        yield pixels[:ready]
        waiting = pixels[ready:] if shared and stop < layout.lens_rows else None


def view_bands(sheet: Sheet, band_px: int) -> Iterator[tuple[int, NDArray[Any]]]:
    """Yield the views of bands of lens rows of an orthoscopic sheet, top down.

    Parameters
    ----------
    sheet
        The orthoscopic sheet.
    band_px
        The approximate number of pixels of a band.

    Yields
    ------
    tuple
        The first lens row, and views `(cell_rows, lens_rows of the band, cell_cols lens_cols, channel)`: `views_grid`
        shows lens row r of view row v in its row v lens_rows + r.
    """
    layout = sheet.layout
    for first, stop in bands(layout, band_px):
        grid = views_grid(sheet.part(first, stop), part_layout(layout, first, stop))
        yield first, grid.reshape(layout.cell_rows, stop - first, *grid.shape[1:])


def _over(pixels: NDArray[Any], waiting: NDArray[Any]) -> NDArray[Any]:
    """Return a band with the rows that the one above has left put together with its own: where both are, they agree."""
    together = pixels.copy()
    top = _bits(together[: len(waiting)])
    np.bitwise_or(top, _bits(waiting), out=top)
    return together


def _bits(pixels: NDArray[Any]) -> NDArray[Any]:
    return pixels.view(f"u{pixels.dtype.itemsize}")


def at_least_two(layout: CellLayout, first: int, stop: int) -> tuple[int, int]:
    """Extend a band so that it can stand alone: one of a hexagonal array has at least two lens rows.

    Parameters
    ----------
    layout
        The layout of the whole.
    first, stop
        The lens rows [first, stop) of the band.
    """
    if stop - first >= min(layout.cell.row_period, layout.lens_rows):
        return first, stop
    return (first, stop + 1) if stop < layout.lens_rows else (first - 1, stop)
