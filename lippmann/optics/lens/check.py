"""Checks of an imaging lens: its surfaces, its media, its stop, and two rays that it must transmit."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import FieldProblem, OpticsError
from lippmann.optics.lens.matrices import system_matrix
from lippmann.optics.lens.stop import marginal_height_mm, stop_space
from lippmann.optics.lens.surfaces import ImagingLens, Stop, Surface
from lippmann.optics.lens.trace import Rays, steps

WEAK_PER_MM = 1e-7
"""The least power of a lens; a system with a focal length of 10 km or more counts as one without power."""

TOUCHING_MM = 1e-9
HEIGHTS = 65
"""The number of heights at which the distance of two surfaces is measured."""

_LENS = "rig.imaging_lens"


def check_lens(lens: ImagingLens, *, field_height_mm: float = 0.0) -> None:
    """Check that a lens can be built and transmits light.

    Parameters
    ----------
    lens
        The imaging lens.
    field_height_mm
        The distance of the farthest point of the image from the axis, mm.

    Raises
    ------
    OpticsError
        The error names every invalid field of a surface or the stop, or the surface that a ray does not pass.
    """
    shape = [*_rims(lens), *_thin_glass(lens), *_crossings(lens), *_stop(lens)]
    problems = shape or [*_power(lens)] or [*_rays(lens, field_height_mm)]
    if problems:
        raise OpticsError.of(problems)


def _rims(lens: ImagingLens) -> Iterator[FieldProblem]:
    for place, surface in enumerate(lens.surfaces):
        if math.isnan(surface.sag_mm(surface.semi_aperture_mm)):
            ends_mm = abs(surface.radius_mm) / math.sqrt(1 + surface.conic)
            yield FieldProblem(
                field=f"{_LENS}.surfaces.{place}.semi_aperture_mm",
                expected=f"at most {ends_mm:.4g} mm, where a surface of radius {surface.radius_mm:g} mm ends",
                got=f"{surface.semi_aperture_mm:g} mm",
            )


def _thin_glass(lens: ImagingLens) -> Iterator[FieldProblem]:
    for place, surface in enumerate(lens.surfaces[:-1]):
        if surface.index_after != 1.0 and surface.thickness_mm <= 0:
            field = f"{_LENS}.surfaces.{place}.thickness_mm"
            yield FieldProblem(field=field, expected="glass above 0 mm", got=f"{surface.thickness_mm:g} mm")


def _crossings(lens: ImagingLens) -> Iterator[FieldProblem]:
    for place, (front, back) in enumerate(zip(lens.surfaces, lens.surfaces[1:], strict=False)):
        rims_mm = front.semi_aperture_mm, back.semi_aperture_mm
        heights_mm = np.linspace(0.0, common_rim_mm(front, rims_mm), HEIGHTS)
        distances_mm = gaps_mm(front, back, heights_mm)
        closest_mm = float(np.nanmin(distances_mm))
        if closest_mm < -TOUCHING_MM:
            clear_mm = heights_mm[max(0, int(np.argmax(distances_mm < 0)) - 1)]
            yield FieldProblem(
                field=f"{_LENS}.surfaces.{place}.thickness_mm",
                expected=f"at least {front.thickness_mm - closest_mm:.4g} mm, or rims within {clear_mm:.4g} mm, where "
                "this surface and the next do not cross inside their apertures",
                got=f"{front.thickness_mm:g} mm",
            )


def common_rim_mm(front: Surface, rims_mm: Sequence[float]) -> float:
    """Return the height out to which two surfaces must not cross: in glass the wider rim, in air the narrower.

    Parameters
    ----------
    front
        The surface before the medium.
    rims_mm
        The semi-apertures of both surfaces, mm.
    """
    return min(rims_mm) if front.index_after == 1.0 else max(rims_mm)


def gaps_mm(front: Surface, back: Surface, heights_mm: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the distances of two surfaces along the axis, mm; NaN beyond the end of a surface.

    Parameters
    ----------
    front, back
        The surfaces.
    heights_mm
        The heights above the axis, mm.
    """
    square = heights_mm**2
    gaps: NDArray[np.float64] = front.thickness_mm + back.profile.sag_mm(square) - front.profile.sag_mm(square)
    return gaps


def _stop(lens: ImagingLens) -> Iterator[FieldProblem]:
    if fault := stop_fault(lens):
        yield FieldProblem(
            field=f"{_LENS}.stop_z_mm", expected=f"a stop in the air{fault}", got=f"{_z_mm(lens) or 0.0:g} mm"
        )


def stop_fault(lens: ImagingLens) -> str:
    """Return why the stop of a lens cannot be built, as the end of a sentence; empty if it can."""
    z_mm = _z_mm(lens)
    if z_mm is None:
        return ""
    semi_mm = lens.stop.semi_aperture_mm if lens.stop else 0.0
    return _stands_in_glass(lens, z_mm) or _cuts_a_surface(lens, Stop(z_mm, semi_mm))


def _z_mm(lens: ImagingLens) -> float | None:
    return lens.stop.z_mm if lens.stop else lens.stop_z_mm


def _stands_in_glass(lens: ImagingLens, z_mm: float) -> str:
    spaces = zip(lens.surfaces, lens.vertices_mm, lens.vertices_mm[1:], strict=False)
    for surface, start_mm, end_mm in spaces:
        if surface.index_after != 1.0 and start_mm < z_mm < end_mm:
            return f", not in the glass from {start_mm:.4g} to {end_mm:.4g} mm"
    return ""


def _cuts_a_surface(lens: ImagingLens, stop: Stop) -> str:
    behind = stop_space(lens, stop)
    for place, (surface, vertex_mm) in enumerate(zip(lens.surfaces, lens.vertices_mm, strict=True)):
        square = np.linspace(0.0, min(stop.semi_aperture_mm, surface.semi_aperture_mm), HEIGHTS) ** 2
        beyond = vertex_mm + surface.profile.sag_mm(square) - stop.z_mm
        if np.nanmax(beyond if place < behind else -beyond) > TOUCHING_MM:
            return f" whose hole is clear of the surface with its vertex at {vertex_mm:.4g} mm"
    return ""


def _power(lens: ImagingLens) -> Iterator[FieldProblem]:
    power_per_mm = -float(system_matrix(lens)[1, 0])
    if abs(power_per_mm) < WEAK_PER_MM:
        yield FieldProblem(field=_LENS, expected="a lens that bends light", got=f"a power of {power_per_mm:.2g} / mm")


def _rays(lens: ImagingLens, field_height_mm: float) -> Iterator[FieldProblem]:
    """Trace the marginal ray, and the chief ray of the image's corner: parallel to the axis on the camera's side."""
    chief_mm = min(field_height_mm, lens.surfaces[-1].semi_aperture_mm)
    yield from _lost(lens, "the ray at the rim of the aperture", height_mm=marginal_height_mm(lens), backward=False)
    yield from _lost(lens, "the chief ray of the image's corner", height_mm=chief_mm, backward=True)


def _lost(lens: ImagingLens, ray: str, *, height_mm: float, backward: bool) -> Iterator[FieldProblem]:
    start = np.array([0.0, height_mm, lens.length_mm if backward else 0.0])
    rays = Rays(start, np.array([0.0, 0.0, -1.0 if backward else 1.0]))
    for place, after in steps(rays, lens, backward=backward):
        if isinstance(place, int) and np.isnan(after.direction).any():
            # A ray beyond the rim is vignetted; any other is stopped by the surface itself.
            if not np.hypot(*after.position[:2]) > lens.surfaces[place].semi_aperture_mm:
                how = "misses it" if np.isnan(after.position).any() else "is totally reflected there"
                yield FieldProblem(
                    field=f"{_LENS}.surfaces.{place}", expected=f"a surface that {ray} passes", got=f"a ray that {how}"
                )
            return
        if np.isnan(after.direction).any():
            return
