"""Imaging lenses as text."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from lippmann.optics.lens.matrices import cardinal_points
from lippmann.optics.lens.stop import f_number, stop_place_mm
from lippmann.terminal.table import fields, table

if TYPE_CHECKING:
    from lippmann.optics.lens.field_spots import FieldSpots
    from lippmann.optics.lens.surfaces import ImagingLens, Surface


def lens_list(lenses: Iterable[ImagingLens]) -> str:
    """Return lenses, one a line."""
    rows = [
        (lens.name, f"{cardinal_points(lens).effective_focal_length_mm:.2f}", f"{f_number(lens):.2f}", lens.title)
        for lens in lenses
    ]
    return table(("name", "efl mm", "f-number", "title"), rows)


def lens_text(lens: ImagingLens, spots: FieldSpots, places: Sequence[str] = ()) -> str:
    """Return a lens with its surfaces and its spots.

    Parameters
    ----------
    lens
        The lens.
    spots
        Its spots.
    places
        The names of the surfaces in the file of the lens, for example `line 12, SURF 3`.
    """
    points = cardinal_points(lens)
    head = fields(
        [
            ("name", lens.name),
            ("title", lens.title),
            ("source", lens.source),
            ("focal length", f"{points.effective_focal_length_mm:.4f} mm"),
            ("back focal distance", f"{points.back_focal_distance_mm:.4f} mm behind the last surface"),
            ("front focal distance", f"{points.front_focal_distance_mm:.4f} mm behind surface 1"),
            ("f-number", f"{f_number(lens):.3f}{' at full aperture' if lens.stop is None else ''}"),
            (
                "stop",
                f"{stop_place_mm(lens):.3f} mm behind surface 1{'' if lens.stop_z_mm is not None else ' (chosen)'}",
            ),
        ]
    )
    columns = ("surface", "radius mm", "thickness mm", "index", "v-no", "sa mm", "conic", "r^4, ...")
    names = [place.rpartition(", ")[2] for place in places] or range(1, len(lens.surfaces) + 1)
    rows = [(name, *_row(surface)) for name, surface in zip(names, lens.surfaces, strict=True)]
    return f"{head}\n\n{table(columns, rows)}\n\n{_spots_text(spots)}"


def _spots_text(spots: FieldSpots) -> str:
    rows = [
        (f"{angle:g}", "no light" if rms_mm is None else f"{rms_mm:.4g}")
        for angle, rms_mm in zip(spots.angles_deg, spots.rms_mm, strict=True)
    ]
    head = f"Spots of distant points, {spots.image_mm:.4f} mm behind the last surface (the best plane on the axis):"
    return f"{head}\n{table(('field degrees', 'rms radius mm'), rows)}"


def _row(surface: Surface) -> tuple[str, ...]:
    return (
        "plane" if math.isinf(surface.radius_mm) else f"{surface.radius_mm:g}",
        f"{surface.thickness_mm:g}",
        "air" if surface.index_after == 1.0 else f"{surface.index_after:g}",
        "" if surface.abbe_after is None else f"{surface.abbe_after:g}",
        f"{surface.semi_aperture_mm:g}",
        f"{surface.conic:g}" if surface.conic else "",
        ", ".join(f"{term:g}" for term in surface.aspheric),
    )
