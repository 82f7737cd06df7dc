"""The imaging lens of a rig: selected by name, scaled or given as a prescription; checked, with its stop set."""

from __future__ import annotations

import math
from typing import Any

from lippmann.errors import FieldProblem, SpecError
from lippmann.job.optics.lens import LensSurface, NamedLens, Prescription
from lippmann.job.optics.rig import Rig
from lippmann.optics.lens.check import check_lens
from lippmann.optics.lens.matrices import cardinal_points
from lippmann.optics.lens.published import ATHINEOS_2006, IMAGING_LENSES
from lippmann.optics.lens.stop import clear_of_glass, with_stop
from lippmann.optics.lens.surfaces import CONTACT_GAP_MM, ImagingLens, Stop, Surface
from lippmann.optics.rig import array as lattice

__all__ = [
    "ATHINEOS_2006",
    "CONTACT_GAP_MM",
    "IMAGING_LENSES",
    "ImagingLens",
    "Stop",
    "Surface",
    "chosen_lens",
    "imaging_lens",
    "lens_of",
    "prescription_of",
    "rig_lens",
]


def rig_lens(rig: Rig) -> ImagingLens | None:
    """Return the imaging lens of a rig with its stop set; None for direct pickup.

    Raises
    ------
    OpticsError, SpecError
        If the lens is unknown, cannot be built, or transmits no light.
    """
    if rig.imaging_lens is None:
        return None
    lens = chosen_lens(rig.imaging_lens)
    check_lens(lens)
    lens = with_stop(lens, rig)
    check_lens(lens, field_height_mm=math.hypot(*lattice.extent_mm(rig.lens_array)) / 2)
    return clear_of_glass(lens.built())


def chosen_lens(choice: str | NamedLens | Prescription) -> ImagingLens:
    """Return the lens that a job chooses, at full aperture, not yet checked."""
    if isinstance(choice, Prescription):
        return lens_of(choice)
    if isinstance(choice, NamedLens):
        lens = imaging_lens(choice.name, field="rig.imaging_lens.name")
        return lens.scaled(choice.focal_length_mm / cardinal_points(lens).effective_focal_length_mm)
    return imaging_lens(choice)


def imaging_lens(name: str, *, field: str = "rig.imaging_lens") -> ImagingLens:
    """Return the published lens of that name.

    Parameters
    ----------
    name
        The name of the lens.
    field
        The field of the job that an error names.

    Raises
    ------
    SpecError
        If no published lens has that name.
    """
    if name not in IMAGING_LENSES:
        known = ", ".join(sorted(IMAGING_LENSES))
        raise SpecError.of([FieldProblem(field=field, expected=f"one of {known}", got=repr(name))])
    return IMAGING_LENSES[name]


def lens_of(prescription: Prescription) -> ImagingLens:
    """Return the lens that a prescription describes."""
    return ImagingLens(
        name="",
        title=prescription.title,
        source=prescription.source,
        surfaces=tuple(map(_surface, prescription.surfaces)),
        stop_z_mm=prescription.stop_z_mm,
    )


def _surface(row: LensSurface) -> Surface:
    return Surface(
        radius_mm=math.inf if row.radius_mm is None else row.radius_mm,
        thickness_mm=row.thickness_mm,
        index_after=row.index,
        semi_aperture_mm=row.semi_aperture_mm,
        conic=row.conic,
        aspheric=row.aspheric,
        abbe_after=row.abbe if row.index != 1.0 else None,
    )


def prescription_of(lens: ImagingLens) -> Prescription:
    """Return the prescription of a lens for a job; the inverse of `lens_of`."""
    return Prescription(
        title=lens.title, source=lens.source, surfaces=tuple(map(_row, lens.surfaces)), stop_z_mm=lens.stop_z_mm
    )


def _row(surface: Surface) -> LensSurface:
    shown: dict[str, Any] = {
        "radius_mm": None if math.isinf(surface.radius_mm) else surface.radius_mm,
        "thickness_mm": surface.thickness_mm,
        "index": surface.index_after,
        "abbe": surface.abbe_after,
        "semi_aperture_mm": surface.semi_aperture_mm,
        "conic": surface.conic,
        "aspheric": surface.aspheric,
    }
    return LensSurface(**shown)
