"""The aperture stop of an imaging lens: its position, its diameter and the resulting f-number."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import FieldProblem, OpticsError
from lippmann.job.optics.rig import Rig
from lippmann.optics.lens.matrices import cardinal_points, matrix_to
from lippmann.optics.lens.surfaces import CONTACT_GAP_MM, ImagingLens, Stop, Surface

NOMINAL = 0.95
"""The tolerance of f-numbers, because printed ones are rounded: one that is faster by 5 % than the glass allows is
accepted, and the glass limits it."""

_AT_MM = 1e-9
_HEIGHTS = 65
"""The number of heights at which the distance of a stop to a surface is measured."""


def stop_place_mm(lens: ImagingLens) -> float:
    """Return the z of a variable stop.

    The prescription may give the position. Otherwise the stop is in the middle of the widest air space between
    elements, or before the front rim of a lens without air spaces. (Athineos 2006 mentions a variable aperture without
    its position.)

    >>> from lippmann.optics.lens.published import ATHINEOS_2006
    >>> round(stop_place_mm(ATHINEOS_2006), 2)
    228.93
    """
    if lens.stop_z_mm is not None:
        return lens.stop_z_mm
    spaces = [
        (surface.thickness_mm, z_mm)
        for surface, z_mm in zip(lens.surfaces[:-1], lens.vertices_mm, strict=False)
        if surface.index_after == 1.0
    ]
    if not spaces or max(spaces)[0] == 0:
        first = lens.surfaces[0]
        return min(0.0, first.sag_mm(first.semi_aperture_mm))
    width_mm, z_mm = max(spaces)
    return z_mm + width_mm / 2


def f_number(lens: ImagingLens) -> float:
    """Return the f-number for a distant object: focal length by twice the height of the marginal ray (paraxial).

    >>> from lippmann.optics.lens.published import ATHINEOS_2006
    >>> round(f_number(ATHINEOS_2006), 3)
    1.502
    """
    focal_mm = cardinal_points(lens).effective_focal_length_mm
    return abs(focal_mm) / (2 * marginal_height_mm(lens))


def marginal_height_mm(lens: ImagingLens) -> float:
    """Return the height before surface 1 of the highest ray parallel to the axis that passes (paraxial)."""
    rims = [(z_mm, surface.semi_aperture_mm) for z_mm, surface in zip(lens.vertices_mm, lens.surfaces, strict=True)]
    if lens.stop is not None:
        rims.append((lens.stop.z_mm, lens.stop.semi_aperture_mm))
    with np.errstate(divide="ignore"):
        return float(min(rim_mm / np.abs(matrix_to(lens, z_mm)[0, 0]) for z_mm, rim_mm in rims))


def with_stop(lens: ImagingLens, rig: Rig) -> ImagingLens:
    """Return the lens with the stop that a rig sets; the lens itself if the rig sets none.

    For an f-number N the diameter of the entrance pupil is f / N, and the stop has that of the beam that fills the
    pupil (paraxial).

    Parameters
    ----------
    lens
        The imaging lens.
    rig
        The rig of the job.

    Raises
    ------
    OpticsError
        If the hole is wider than the glass there, or the glass does not let that f-number through.
    """
    if rig.stop_mm is not None:
        return _opened(lens, rig.stop_mm / 2, field="rig.stop_mm", got=f"{rig.stop_mm:g} mm")
    if rig.f_number is None:
        return lens
    fastest = f_number(lens)
    if rig.f_number < fastest * NOMINAL:
        raise _impossible("rig.f_number", f"at least {fastest:.4g}, the full aperture", f"{rig.f_number:g}")
    focal_mm = cardinal_points(lens).effective_focal_length_mm
    narrowing = matrix_to(lens, stop_place_mm(lens))[0, 0]
    semi_mm = float(abs(narrowing * focal_mm)) / (2 * rig.f_number)
    got = f"{rig.f_number:g}, a hole of {2 * semi_mm:.4g} mm"
    return _opened(lens, semi_mm, field="rig.f_number", got=got)


def clear_of_glass(lens: ImagingLens) -> ImagingLens:
    """Return a lens with its stop at least `CONTACT_GAP_MM` from both surfaces, or midway between closer surfaces.

    A plate on a plane surface would coincide with it, and the result of a ray tracer would be undefined.
    """
    if lens.stop is None:
        return lens
    behind = stop_space(lens, lens.stop)
    least_mm, most_mm = -math.inf, math.inf
    if behind > 0:
        least_mm = float(np.nanmax(_profile_mm(lens, behind - 1, lens.stop))) + CONTACT_GAP_MM
    if behind < len(lens.surfaces):
        most_mm = float(np.nanmin(_profile_mm(lens, behind, lens.stop))) - CONTACT_GAP_MM
    if least_mm > most_mm:
        return replace(lens, stop=replace(lens.stop, z_mm=(least_mm + most_mm) / 2))
    return replace(lens, stop=replace(lens.stop, z_mm=min(max(lens.stop.z_mm, least_mm), most_mm)))


def stop_space(lens: ImagingLens, stop: Stop) -> int:
    """Return the number of surfaces before a stop; a stop at the vertex of a front face is before that face.

    Parameters
    ----------
    lens
        The imaging lens.
    stop
        The stop, with its place along the axis.
    """
    before = sum(vertex_mm <= stop.z_mm + _AT_MM for vertex_mm in lens.vertices_mm)
    in_glass = before > 0 and lens.surfaces[before - 1].index_after != 1.0
    return before - 1 if in_glass else before


def _profile_mm(lens: ImagingLens, place: int, stop: Stop) -> NDArray[np.float64]:
    """Return the z of a surface that a stop must not touch: inside the hole, or on the whole surface if it is flat."""
    surface = lens.surfaces[place]
    reach_mm = surface.semi_aperture_mm
    if not surface.is_flat:
        reach_mm = min(reach_mm, stop.semi_aperture_mm)
    sag_mm: NDArray[np.float64] = surface.profile.sag_mm(np.linspace(0.0, reach_mm, _HEIGHTS) ** 2)
    return lens.vertices_mm[place] + sag_mm


def _opened(lens: ImagingLens, semi_mm: float, *, field: str, got: str) -> ImagingLens:
    stop = Stop(stop_place_mm(lens), semi_mm)
    widest_mm = 2 * max(surface.semi_aperture_mm for surface in _beside(lens, stop.z_mm))
    if 2 * semi_mm > widest_mm:
        raise _impossible(field, f"a stop at most as wide as the glass there, {widest_mm:.4g} mm", got)
    return replace(lens, stop=stop)


def _beside(lens: ImagingLens, z_mm: float) -> tuple[Surface, ...]:
    """Return the surfaces before and behind a position; only one if the position is outside the lens."""
    before = sum(vertex_mm <= z_mm for vertex_mm in lens.vertices_mm)
    return lens.surfaces[max(0, before - 1) : before + 1]


def _impossible(field: str, expected: str, got: str) -> OpticsError:
    return OpticsError.of([FieldProblem(field=field, expected=expected, got=got)])
