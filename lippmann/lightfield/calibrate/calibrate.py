"""Calibration: pitch, lattice, rotation and position of the lenses over a picture, and its reliability."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import LayoutError
from lippmann.lightfield.calibrate.combs import BLOCK_PX, measure_comb
from lippmann.lightfield.calibrate.evidence import of_white, tone_of
from lippmann.lightfield.calibrate.interference import Interference
from lippmann.lightfield.calibrate.periods import shortest_steps
from lippmann.lightfield.calibrate.phases import Lay, Measured, lay_of, measure
from lippmann.lightfield.calibrate.whole_lenses import whole_lenses
from lippmann.lightfield.quality.luminance import luminance
from lippmann.lightfield.sheet.lens_grid import LensGrid

SURE_OF_WHITE = 0.9
SURE_OF_EDGES = 0.25
"""The least agreement of a lattice that is believed: of a white image, and of the edges of cells in a picture."""

RIVAL = 0.75
"""The share of the best agreement from which another lattice makes the calibration ambiguous."""

WHITE = "a white image of a regular array of lenses, bright in their middles"
EDGES = "an integral image whose cells' borders show all over it"

SAME_PERIOD = 0.002
"""The relative difference from the side of a block below which a grid counts as one of blocks."""

LEAST_SIDE_PX = 24


@dataclass(frozen=True)
class Calibration:
    """The calibrated lenses of a picture."""

    grid: LensGrid
    """The largest block of whole lenses."""
    agreement: float
    """The agreement of the parts of the picture, 0 to 1."""


def calibrate_white_image(picture: NDArray[Any]) -> Calibration:
    """Calibrate the lenses from a picture of an evenly lit white surface.

    As white images serve to calibrate light-field cameras (Dansereau, Pizarro, Williams, *Decoding, calibration and
    rectification for lenselet-based plenoptic cameras*, IEEE CVPR 2013), here by the lattice's waves instead of a
    maximum for every lens.

    Parameters
    ----------
    picture
        `(rows, cols, channel)`, linear light; every lens brighter in the middle than at its border.

    Raises
    ------
    LayoutError
        If there is no regular lattice, or it stands on its side.
    """
    evidence = of_white(luminance(_finite(picture)))
    steps = shortest_steps(evidence)
    rough = lay_of(steps) if steps else None
    if steps is not None and rough is None:
        first, second = (f"({step[0]:.1f}, {step[1]:.1f})" for step in (steps.first, steps.second))
        raise LayoutError(
            f"expected {WHITE}, square or hexagonal with level rows, got one that repeats by {first} and {second} px to"
            " the right and down"
        )
    measured = measure(evidence, measure(evidence, rough).lay) if rough else None
    return _checked(measured, SURE_OF_WHITE, WHITE, picture.shape[:2])


def calibrate_picture(picture: NDArray[Any], *, near_px: float | None = None) -> Calibration:
    """Calibrate the lenses from any integral image, by the edges between cells; a white image is more exact.

    Parameters
    ----------
    picture
        `(rows, cols, channel)`, linear light.
    near_px
        The pitch, if it is known to 3 %: only periods near it are searched.

    Raises
    ------
    LayoutError
        If the picture does not determine the lattice, or fits another lattice as well.
    """
    comb = measure_comb(tone_of(_finite(picture)), near_px=near_px)
    lenses = comb.lenses
    if lenses is None and comb.grid is not None and comb.grid.agreement >= SURE_OF_EDGES:
        _refuse_grid(comb.grid.lay)
    found = _checked(lenses, SURE_OF_EDGES, EDGES, picture.shape[:2])
    if lenses is not None and comb.rival is not None:
        _refuse_rival(lenses, comb.rival)
    if lenses is not None and comb.disturbed is not None:
        _refuse_disturbed(lenses, comb.disturbed)
    return found


def _finite(picture: NDArray[Any]) -> NDArray[np.float32]:
    if picture.ndim != 3 or min(picture.shape[:2]) < LEAST_SIDE_PX:
        raise LayoutError(
            f"expected a picture of at least {LEAST_SIDE_PX} px a side to look for lenses, got shape {picture.shape}"
        )
    finite: NDArray[np.float32] = np.nan_to_num(picture.astype(np.float32, copy=False), nan=0.0, posinf=1.0, neginf=0.0)
    return finite


def _refuse_grid(lay: Lay) -> None:
    """Refuse a grid that is not that of lenses."""
    if abs(lay.pitch_px / BLOCK_PX - 1) < SAME_PERIOD:
        why = f"as the blocks of JPEG are, of {BLOCK_PX:g} px"
        raise LayoutError(
            f"expected {EDGES}, got one whose only grid has a period of {lay.pitch_px:.2f} px, {why}; give the pitch"
            " and leave out --find"
        )
    raise LayoutError(
        f"expected {EDGES}, got one with a grid of {lay.pitch_px:.2f} px that is not of lenses: what is shown goes on"
        " across it, as across the blocks of a codec or a part of a cell; give the pitch"
    )


def _refuse_rival(lenses: Measured, rival: Measured) -> None:
    """Refuse an ambiguous lattice: the content of the picture may repeat as clearly as the lenses do."""
    if rival.agreement > RIVAL * lenses.agreement:
        raise LayoutError(
            f"expected {EDGES}, got one that may have a pitch of {lenses.lay.pitch_px:.2f} px"
            f" ({lenses.agreement:.2f} of 1) or of {rival.lay.pitch_px:.2f} px ({rival.agreement:.2f}); give"
            " the pitch approximately"
        )


def _refuse_disturbed(lenses: Measured, disturbed: Interference) -> None:
    """Refuse a pitch that another grid may have drawn away, as blocks of a codec do."""
    why = f"another grid, of {disturbed.grid.lay.pitch_px:.2f} px, is clearer, as the blocks of JPEG are after scaling"
    other = "" if disturbed.pitch_px is None else f", or {disturbed.pitch_px:.2f} px by the lines that it does not have"
    name, found_px = (("pitch", lenses.lay.pitch_px), ("row pitch", lenses.lay.row_pitch_px))[disturbed.axis]
    raise LayoutError(
        f"expected {EDGES}, got one whose {name} is uncertain, {found_px:.2f} px by the borders of the"
        f" cells{other}: {why}; give the pitch and leave out --find"
    )


def _checked(measured: Measured | None, sure: float, wanted: str, size: tuple[int, ...]) -> Calibration:
    if measured is None:
        raise LayoutError(f"expected {wanted}, got none: there is no lattice to be seen; give the pitch")
    if not measured.agreement >= sure:
        raise LayoutError(
            f"expected {wanted}, got none that is certain: a pitch of {measured.lay.pitch_px:.2f} px is seen with"
            f" {measured.agreement:.2f} of 1, and {sure:g} is needed; give the pitch"
        )
    return Calibration(_grid(measured, size), measured.agreement)


def _grid(measured: Measured, size: tuple[int, ...]) -> LensGrid:
    lay = measured.lay
    one = LensGrid(
        1,
        1,
        pitch_px=lay.pitch_px,
        offset_px=measured.centre_px,
        lattice=lay.lattice,
        row_pitch_px=lay.row_pitch_px,
        turn_deg=lay.turn_deg,
    )
    return whole_lenses(one, size)
