"""The size of an integral image in pixels, and its tiles, which are cut along lens edges.

Pixels count from the top left: row 0 is the top, col 0 the left, as the observer sees the display.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypedDict

from lippmann.job.messages.orders import TileIndex
from lippmann.job.optics.rig import Device, Rig
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.sheet.orthoscopic import orthoscopic_layout


@dataclass(frozen=True)
class Tile:
    """A part of a frame, cut along lens edges: pixel rows [row_start, row_stop) and columns [col_start, col_stop)."""

    index: TileIndex
    row_start: int
    row_stop: int
    col_start: int
    col_stop: int

    @property
    def rows(self) -> int:
        """The height, px."""
        return self.row_stop - self.row_start

    @property
    def cols(self) -> int:
        """The width, px."""
        return self.col_stop - self.col_start

    @property
    def px(self) -> int:
        """The number of pixels."""
        return self.rows * self.cols


def frame_size(rig: Rig) -> CellLayout:
    """Return the size of the integral images that a rig captures."""
    return rig.layout


def display_size(rig: Rig) -> CellLayout:
    """Return the layout of the orthoscopic integral images of a rig, from which its views are made."""
    return orthoscopic_layout(frame_size(rig), inverted=rig.imaging_lens is not None)


class DevicePixels(TypedDict):
    """The arguments of `lippmann.lightfield.sheet.device` for a device."""

    px_per_lens_device: float
    window: tuple[int, int] | None
    margin_px: int


def device_pixels(device: Device, *, pitch_mm: float) -> DevicePixels:
    """Return the arguments for lenses of a pitch on the pixels of a device."""
    per_lens = pitch_mm / device.pixel_mm
    return {"px_per_lens_device": per_lens, "window": device.window_px, "margin_px": device.margin_px}


def cut_tiles(size: CellLayout, *, tile_rows: int, tile_cols: int) -> tuple[Tile, ...]:
    """Cut a frame into approximately equal tiles along lens edges, row by row; there are at most as many as lenses.

    Hexagonal frames are cut along lens rows, half-way between their centres, and between the lenses of the rows that
    are not shifted. Pixels beyond the lens rows belong to the first and the last tile, and so do those on the right.

    Examples
    --------
    >>> [(t.row_start, t.row_stop) for t in cut_tiles(CellLayout(5, 1, 8), tile_rows=2, tile_cols=1)]
    [(0, 16), (16, 40)]
    >>> [(t.row_start, t.row_stop) for t in cut_tiles(CellLayout(5, 1, 8, "hexagonal"), tile_rows=2, tile_cols=1)]
    [(0, 16), (16, 39)]
    """
    row_edges = _shared_out(size.row_edges, tile_rows)
    col_edges = _shared_out(size.col_edges, tile_cols)
    return tuple(
        Tile(TileIndex(row=row, col=col), row_edges[row], row_edges[row + 1], col_edges[col], col_edges[col + 1])
        for row in range(len(row_edges) - 1)
        for col in range(len(col_edges) - 1)
    )


def _shared_out(edges: tuple[int, ...], parts: int) -> list[int]:
    lenses = len(edges) - 1
    parts = min(parts, lenses)
    return [edges[lenses * part // parts] for part in range(parts + 1)]
