"""The model of an imaging lens: surfaces, media and a stop, object side first."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import accumulate

import numpy as np

from lippmann.optics.lens.asphere import Profile

CONTACT_GAP_MM = 1e-3
"""The air gap between surfaces that touch, because coincident surfaces are undefined in a ray tracer."""


FLAT_MM = 0.01
"""The greatest sag of a surface that counts as plane."""


@dataclass(frozen=True)
class Surface:
    """A surface of rotation and the medium behind it."""

    radius_mm: float
    """The radius of curvature at the vertex, positive if the centre lies behind it (greater z); infinite for a
    plane."""
    thickness_mm: float
    """The distance to the vertex of the next surface; 0 for the last."""
    index_after: float
    """The refractive index of the medium behind the surface."""
    semi_aperture_mm: float
    conic: float = 0.0
    """The conic constant: 0 for a sphere, -1 for a paraboloid, less for a hyperboloid."""
    aspheric: tuple[float, ...] = ()
    """The coefficients of r^4, r^6, ... in the sag."""
    abbe_after: float | None = None
    """The Abbe number Vd of the medium behind the surface; None for a medium without dispersion."""

    @property
    def curvature_per_mm(self) -> float:
        """The curvature, 1 / radius; 0 for a plane."""
        return 0.0 if math.isinf(self.radius_mm) else 1.0 / self.radius_mm

    @property
    def profile(self) -> Profile:
        """The profile of the surface, relative to its vertex."""
        return Profile(self.curvature_per_mm, self.conic, self.aspheric)

    @property
    def is_spherical(self) -> bool:
        """True if the surface is a sphere or a plane."""
        return not any(self.aspheric) and (self.conic == 0.0 or math.isinf(self.radius_mm))

    @property
    def is_flat(self) -> bool:
        """True if the surface is a plane, or so nearly one that a plate beside its vertex would lie on it."""
        return abs(self.sag_mm(self.semi_aperture_mm)) < FLAT_MM

    def sag_mm(self, height_mm: float) -> float:
        """Return the sag of the surface at a height above the axis; NaN beyond its rim.

        >>> round(Surface(-300.0, 0.0, 1.0, 100.0).sag_mm(100.0), 4)
        -17.1573
        """
        return float(self.profile.sag_mm(np.array(height_mm**2)))

    def scaled(self, factor: float) -> Surface:
        """Return the surface with all lengths times a factor."""
        return replace(
            self,
            radius_mm=self.radius_mm * factor,
            thickness_mm=self.thickness_mm * factor,
            semi_aperture_mm=self.semi_aperture_mm * factor,
            # A term of r^m is in mm^(1 - m).
            aspheric=tuple(term / factor**power for power, term in zip(range(3, 99, 2), self.aspheric, strict=False)),
        )


@dataclass(frozen=True)
class Stop:
    """An opaque plane across the axis with a round hole."""

    z_mm: float
    semi_aperture_mm: float


@dataclass(frozen=True)
class ImagingLens:
    """A lens system in air."""

    name: str
    title: str
    source: str
    surfaces: tuple[Surface, ...]
    stop_z_mm: float | None = None
    """The place of a variable stop behind the first vertex; None if the prescription does not give it."""
    stop: Stop | None = None
    """The stop; None if the lens works at full aperture."""

    @property
    def vertices_mm(self) -> tuple[float, ...]:
        """The z of every surface's vertex; the first is 0."""
        return tuple(accumulate((surface.thickness_mm for surface in self.surfaces[:-1]), initial=0.0))

    @property
    def length_mm(self) -> float:
        """The distance from the first vertex to the last."""
        return self.vertices_mm[-1]

    @property
    def indices_before(self) -> tuple[float, ...]:
        """The index of the medium before every surface."""
        return (1.0, *(surface.index_after for surface in self.surfaces[:-1]))

    @property
    def semi_aperture_mm(self) -> float:
        """The semi-aperture of the narrowest surface."""
        return min(surface.semi_aperture_mm for surface in self.surfaces)

    @property
    def is_spherical(self) -> bool:
        """True if all surfaces are spheres or planes."""
        return all(surface.is_spherical for surface in self.surfaces)

    @property
    def surfaces_before_stop(self) -> int:
        """The number of surfaces before the stop."""
        if self.stop is None:
            return 0
        return sum(z_mm <= self.stop.z_mm for z_mm in self.vertices_mm)

    def scaled(self, factor: float) -> ImagingLens:
        """Return the lens with all lengths times a factor."""
        stop = self.stop and Stop(self.stop.z_mm * factor, self.stop.semi_aperture_mm * factor)
        place_mm = None if self.stop_z_mm is None else self.stop_z_mm * factor
        surfaces = tuple(surface.scaled(factor) for surface in self.surfaces)
        return replace(self, surfaces=surfaces, stop_z_mm=place_mm, stop=stop)

    def built(self) -> ImagingLens:
        """Return the lens with surfaces that touch in air moved `CONTACT_GAP_MM` apart.

        Cemented surfaces stay one surface. Everything behind a new gap, including the stop, moves back by it.
        """
        *inner, last = self.surfaces
        spaced = (
            replace(surface, thickness_mm=max(surface.thickness_mm, CONTACT_GAP_MM))
            if surface.index_after == 1.0
            else surface
            for surface in inner
        )
        lens = replace(self, surfaces=(*spaced, last))
        return replace(lens, stop_z_mm=self._moved(self.stop_z_mm, lens), stop=self._moved_stop(lens))

    def _moved_stop(self, lens: ImagingLens) -> Stop | None:
        if self.stop is None:
            return None
        return replace(self.stop, z_mm=self.stop.z_mm + self._shift(self.stop.z_mm, lens))

    def _moved(self, z_mm: float | None, lens: ImagingLens) -> float | None:
        return None if z_mm is None else z_mm + self._shift(z_mm, lens)

    def _shift(self, z_mm: float, lens: ImagingLens) -> float:
        before = [new - old for old, new in zip(self.vertices_mm, lens.vertices_mm, strict=True) if old <= z_mm]
        return before[-1] if before else 0.0
