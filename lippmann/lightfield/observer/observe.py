"""The virtual observer: what an eye sees of a display.

Rays go from every pixel of the picture back through the pupil to the display. The picture lies in the plane of the
array, as if one traced on a pane of glass what shows through, so a pixel is a place Q there. With the pupil's middle E
at a distance L, a point e of the pupil from it, the eye focused at a depth z, and the reduced gap g:

    place on the array     A = Q - e z / (L - z)           all rays of a pixel meet in the plane of focus
    slope toward the sheet m = (A - E - e) / L
    behind the lens at c   m' = m - (A - c) / f            a thin lens, paraxial
    place on the sheet     S = A + g m'

The eye gets the light of whatever pixel S lies in: pixels are boxes, nothing is interpolated. It may lie under a
neighbouring lens; that is how the picture flips at the border of the viewing zone. Where there is no lens light goes
straight (m' = m), or it is black. A pixel of the picture is the mean over the pupil and over its own area.

`views.perspective` is the same with pinholes for lenses, which show their own cell only, one pixel a lens.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import LayoutError
from lippmann.job.optics.viewing import PUPIL_MM, RAYS, SIZE_PX
from lippmann.lattice.cell import ON_THE_BORDER
from lippmann.lightfield.observer.display import LensDisplay, LensLine, lens_lines
from lippmann.lightfield.observer.eye_rays import eye_rays
from lippmann.lightfield.observer.window import Window, window_of
from lippmann.lightfield.sheet.interpolation import Light
from lippmann.lightfield.views.perspective import Eye, inside_cells, places_px

ROWS_AT_ONCE = 64
"""The rows of the picture that are computed together, so that they stay in the cache of the processor."""


def whole_window(display: LensDisplay, *, size_px: int = SIZE_PX) -> Window:
    """Return the window that the lens array fills.

    Parameters
    ----------
    display
        The display.
    size_px
        The longer side of the picture, px.

    Raises
    ------
    LayoutError
        If the size is not positive, or too large.
    """
    high_mm, wide_mm = display.array_mm
    return window_of(wide_mm=wide_mm, high_mm=high_mm, size_px=size_px)


def observe(
    sheet: NDArray[Light],
    display: LensDisplay,
    eye: Eye,
    *,
    pupil_mm: float = PUPIL_MM,
    focus_mm: float = 0.0,
    rays: int = RAYS,
    window: Window | None = None,
) -> NDArray[np.floating[Any]]:
    """Trace the rays of an eye to a display and return the picture that it sees; see the module.

    Parameters
    ----------
    sheet
        The display's pixels `(rows, cols, channel)`, linear light: an orthoscopic sheet, or one of a device's pixels.
    display
        Lenses, gap and pixels.
    eye
        Where the middle of the pupil is.
    pupil_mm
        Its diameter.
    focus_mm
        The depth that is sharp, positive in front of the display; -inf for an eye that looks into the distance.
    rays
        For every pixel; a single one goes through the middle of the pupil and of the pixel.
    window
        The part of the array's plane in the picture; None for the array, 720 px.

    Returns
    -------
    NDArray
        `(window.rows, window.cols, channel)`, in single precision or the sheet's, if higher.

    Raises
    ------
    LayoutError
        If the sheet is not of the display's layout or, of a device's pixels, smaller than the array, the pupil is not
        positive, or the focus does not lie before the eye.
    """
    display.check(sheet)
    if not 0 < pupil_mm < math.inf:
        raise LayoutError(f"expected a pupil of a positive diameter in mm, got {pupil_mm:g}")
    if math.isnan(focus_mm) or focus_mm >= eye.distance_mm:
        raise LayoutError(f"expected a focus nearer to the display than the eye, {eye}, got {focus_mm:g} mm")
    window = window or whole_window(display)
    lit = _lit(sheet, display)
    light = np.zeros((window.rows, window.cols, sheet.shape[2]), dtype=lit.dtype)
    for path in _paths(display, eye, window, sheet.shape[:2], pupil_mm=pupil_mm, focus_mm=focus_mm, rays=rays):
        for start in range(0, window.rows, ROWS_AT_ONCE):
            rows = slice(start, start + ROWS_AT_ONCE)
            light[rows] += lit.take(path.pixels(rows), axis=0)
    light /= rays
    return light


def own_share(display: LensDisplay, eye: Eye) -> float:
    """Return the share of lenses whose middle shows an eye their own cell: 1 inside the viewing zone of all lenses.

    Parameters
    ----------
    display
        The display.
    eye
        The place of the eye.
    """
    right, down = places_px(display.layout, eye, pitch_mm=display.pitch_mm, gap_mm=display.gap_mm)
    return float(inside_cells(display.layout, right, down).mean())


def _lit(sheet: NDArray[Light], display: LensDisplay) -> NDArray[np.floating[Any]]:
    """Return the pixels in one line `(pixel, channel)`, with a frame of surrounding light, and black at the end."""
    rows, cols, channels = sheet.shape
    light = np.zeros(((rows + 2) * (cols + 2) + 1, channels), dtype=np.result_type(sheet.dtype, np.float32))
    framed = light[:-1].reshape(rows + 2, cols + 2, channels)
    framed[:] = 1.0 if display.surround == "white" else 0.0
    framed[1:-1, 1:-1] = sheet
    return light


@dataclass(frozen=True)
class _Line:
    """One ray's places on one axis: which pixel it takes behind the nearest lens of a line, and which without lens."""

    pixel: NDArray[np.intp]
    bare: NDArray[np.intp]
    under: NDArray[np.bool_]
    """True where the nearest lens exists."""
    away: NDArray[np.float64]
    """Square of the distance from its middle, mm^2."""


@dataclass(frozen=True)
class _Path:
    """One ray's way to every pixel of the picture; for each rectangular grid of lenses (down, across)."""

    grids: tuple[tuple[_Line, _Line], ...]
    round_mm2: float | None
    """Square of a round lens's radius."""
    black: int | None
    """The pixel to take where no lens is; None: what lies there."""

    def pixels(self, rows: slice) -> NDArray[np.intp]:
        """Return which pixel of the line of pixels each of these rows' pixels shows, `(row, col)`."""
        down, across = self.grids[0]
        found, covered = _crossed(down.pixel[rows], across.pixel), self._covered(rows, down, across)
        for down, across in self.grids[1:]:
            first_down, first_across = self.grids[0]
            nearer = down.away[rows, np.newaxis] - first_down.away[rows, np.newaxis] < first_across.away - across.away
            found = np.where(nearer, _crossed(down.pixel[rows], across.pixel), found)
            covered = np.where(nearer, self._covered(rows, down, across), covered)
        if covered.all():
            return found
        bare = _crossed(down.bare[rows], across.bare) if self.black is None else self.black
        return np.where(covered, found, bare)

    def _covered(self, rows: slice, down: _Line, across: _Line) -> NDArray[np.bool_]:
        covered = down.under[rows, np.newaxis] & across.under
        if self.round_mm2 is not None:
            covered &= down.away[rows, np.newaxis] + across.away <= self.round_mm2
        return covered


def _paths(
    display: LensDisplay,
    eye: Eye,
    window: Window,
    sheet_px: tuple[int, ...],
    *,
    pupil_mm: float,
    focus_mm: float,
    rays: int,
) -> Iterator[_Path]:
    spread = eye_rays(rays)
    black = (sheet_px[0] + 2) * (sheet_px[1] + 2) if display.bare == "black" else None
    round_mm2 = (display.pitch_mm / 2) ** 2 if display.aperture == "inscribed" else None
    tilt = -1.0 if focus_mm == -math.inf else focus_mm / (eye.distance_mm - focus_mm)
    px_mm = (window.high_mm / window.rows, window.wide_mm / window.cols)
    seen_mm, eye_mm, row_px = (window.down_mm, window.across_mm), (-eye.y_mm, eye.x_mm), sheet_px[1] + 2
    for pupil, pixel in zip(spread.pupil[:, ::-1] * pupil_mm / 2, spread.pixel[:, ::-1], strict=True):
        axes = []
        for axis in (0, 1):
            at_mm = seen_mm[axis] + pixel[axis] * px_mm[axis] - pupil[axis] * tilt
            axes.append(
                _Axis(
                    at_mm=at_mm,
                    slope=(at_mm - eye_mm[axis] - pupil[axis]) / eye.distance_mm,
                    display=display,
                    px_mm=display.pixel_mm[axis],
                    px=sheet_px[axis],
                    stride=row_px if axis == 0 else 1,
                )
            )
        yield _Path(
            grids=tuple((axes[0].behind(down), axes[1].behind(across)) for down, across in lens_lines(display)),
            round_mm2=round_mm2,
            black=black,
        )


@dataclass(frozen=True)
class _Axis:
    """One ray on one axis, before it meets the lenses."""

    at_mm: NDArray[np.float64]
    """The places on the array."""
    slope: NDArray[np.float64]
    display: LensDisplay
    px_mm: float
    px: int
    stride: int
    """The distance of two neighbours on this axis in the flat array of pixels."""

    def behind(self, line: LensLine) -> _Line:
        centre_mm, under = line.nearest(self.at_mm)
        bent = self.slope - (self.at_mm - centre_mm) / self.display.focal_mm
        return _Line(
            pixel=self._pixel(bent), bare=self._pixel(self.slope), under=under, away=(self.at_mm - centre_mm) ** 2
        )

    def _pixel(self, slope: NDArray[np.float64]) -> NDArray[np.intp]:
        place = (self.at_mm + self.display.gap_mm * slope) / self.px_mm + self.px / 2
        number = np.clip(np.floor(place + ON_THE_BORDER), -1, self.px).astype(np.intp) + 1
        return number * self.stride


def _crossed(down: NDArray[np.intp], across: NDArray[np.intp]) -> NDArray[np.intp]:
    return down[:, np.newaxis] + across
