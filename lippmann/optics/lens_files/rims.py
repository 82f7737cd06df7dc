"""Rims of surfaces that would cross: design programs compute semi-diameters from rays, and not from the glass."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from lippmann.job.optics.lens import LensSurface
from lippmann.optics.lens.check import common_rim_mm, gaps_mm
from lippmann.optics.lens.prescription import lens_of
from lippmann.optics.lens.surfaces import Surface
from lippmann.optics.lens_files.lens_file import LensFile

HEIGHTS = 1025
"""The number of heights at which the distance of two surfaces is measured."""
ROUND_DOWN_MM = 1e-4
LEAST_PART = 0.5
"""The least part of a semi-diameter that may remain; a file that needs less has another fault."""


def with_rims_apart(file: LensFile, may_shrink: Sequence[bool]) -> LensFile:
    """Return the lens of a file with the rims reduced to where neighbouring surfaces touch, and a note.

    Parameters
    ----------
    file
        The lens of the file.
    may_shrink
        Whether the semi-diameter of each surface is one that a program computed, and not one that its user set.
    """
    shapes = lens_of(file.prescription).surfaces
    semis_mm = [shape.semi_aperture_mm for shape in shapes]
    for place, (front, back) in enumerate(pairwise(shapes)):
        pair = [place, place + 1]
        clear_mm = _clear_mm(front, back, [semis_mm[one] for one in pair])
        if front.index_after == 1.0:
            # In air one rim within the crossing is enough, that of the narrower surface.
            pair = sorted((one for one in pair if may_shrink[one]), key=lambda one: semis_mm[one])[:1]
        wide = [one for one in pair if semis_mm[one] > clear_mm]
        if all(may_shrink[one] and clear_mm >= LEAST_PART * semis_mm[one] for one in wide):
            for one in wide:
                semis_mm[one] = clear_mm
    return _with_semi_apertures(file, semis_mm)


def _clear_mm(front: Surface, back: Surface, semis_mm: Sequence[float]) -> float:
    """Return the height out to which two surfaces do not cross, mm; infinite if they do not inside their rims."""
    heights_mm = np.linspace(0.0, common_rim_mm(front, semis_mm), HEIGHTS)
    crossed = np.flatnonzero(gaps_mm(front, back, heights_mm) < 0)
    if not crossed.size:
        return float("inf")
    return float(np.floor(heights_mm[max(0, int(crossed[0]) - 1)] / ROUND_DOWN_MM) * ROUND_DOWN_MM)


def _with_semi_apertures(file: LensFile, semis_mm: Sequence[float]) -> LensFile:
    old = file.prescription.surfaces
    changed = [place for place, row in enumerate(old) if semis_mm[place] < row.semi_aperture_mm]
    if not changed:
        return file
    surfaces = tuple(_of_size(row, semi_mm) for row, semi_mm in zip(old, semis_mm, strict=True))
    notes = [
        f"{file.places[place]}: the semi-diameter is reduced from {old[place].semi_aperture_mm:.5g} to "
        f"{semis_mm[place]:.5g} mm, where this surface and its neighbour would cross"
        for place in changed
    ]
    prescription = file.prescription.model_copy(update={"surfaces": surfaces})
    return replace(file, prescription=prescription, notes=(*file.notes, *notes))


def _of_size(row: LensSurface, semi_mm: float) -> LensSurface:
    return row.model_copy(update={"semi_aperture_mm": round(semi_mm, 4)}) if semi_mm < row.semi_aperture_mm else row
