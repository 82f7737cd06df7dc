"""Imaging lenses as tables of surfaces, object side first, and the published ones by name."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from types import MappingProxyType

from worker.errors import FieldProblem, SpecError

CONTACT_GAP_MM = 1e-3
"""Air kept between surfaces that touch: coincident surfaces are undefined in a ray tracer."""


@dataclass(frozen=True)
class Surface:
    """A spherical or plane surface and the medium behind it."""

    radius_mm: float
    """Radius of curvature, positive when the centre lies behind (greater z); infinite for a plane."""
    thickness_mm: float
    """To the vertex of the next surface; 0 for the last."""
    index_after: float
    """Refractive index of the medium behind the surface."""
    semi_aperture_mm: float

    @property
    def curvature_per_mm(self) -> float:
        """1 / radius; 0 for a plane."""
        return 0.0 if math.isinf(self.radius_mm) else 1.0 / self.radius_mm

    def sag_mm(self, height_mm: float) -> float:
        """Return how far the surface lies behind its vertex at a height above the axis.

        >>> round(Surface(-300.0, 0.0, 1.0, 100.0).sag_mm(100.0), 4)
        -17.1573
        """
        if math.isinf(self.radius_mm):
            return 0.0
        root = math.sqrt(self.radius_mm**2 - height_mm**2)
        return self.radius_mm - math.copysign(root, self.radius_mm)


@dataclass(frozen=True)
class ImagingLens:
    """A lens system in air."""

    name: str
    title: str
    source: str
    surfaces: tuple[Surface, ...]

    @property
    def vertices_mm(self) -> tuple[float, ...]:
        """The z of every surface's vertex; the first is 0."""
        z, vertices = 0.0, []
        for surface in self.surfaces:
            vertices.append(z)
            z += surface.thickness_mm
        return tuple(vertices)

    @property
    def length_mm(self) -> float:
        """From the first vertex to the last."""
        return self.vertices_mm[-1]

    @property
    def semi_aperture_mm(self) -> float:
        """The narrowest surface's."""
        return min(surface.semi_aperture_mm for surface in self.surfaces)

    def built(self) -> ImagingLens:
        """Return the lens as it is modelled: surfaces in contact kept `CONTACT_GAP_MM` apart."""
        *inner, last = self.surfaces
        spaced = (
            replace(surface, thickness_mm=max(surface.thickness_mm, CONTACT_GAP_MM))
            if surface.index_after == 1.0
            else surface
            for surface in inner
        )
        return replace(self, surfaces=(*spaced, last))


_INF = math.inf

ATHINEOS_2006 = ImagingLens(
    name="athineos-2006",
    title="Two plano-convex condenser lenses and a thick plano-convex lens, f/1.5",
    source="Athineos et al., J. Electronic Imaging 15(3), 2006, Table 1, doi 10.1117/1.2360692",
    surfaces=(
        Surface(_INF, 84.28, 1.51, 100.0),
        Surface(-242.38, 289.30, 1.0, 100.0),
        Surface(_INF, 17.16, 1.50, 100.0),
        Surface(-300.0, 0.0, 1.0, 100.0),
        Surface(300.0, 17.16, 1.50, 100.0),
        Surface(_INF, 0.0, 1.0, 100.0),
    ),
)

IMAGING_LENSES = MappingProxyType({lens.name: lens for lens in (ATHINEOS_2006,)})
"""The lenses that a job can name."""


def imaging_lens(name: str) -> ImagingLens:
    """Return the lens of that name.

    Raises
    ------
    SpecError
        If there is none.
    """
    if name not in IMAGING_LENSES:
        known = ", ".join(sorted(IMAGING_LENSES))
        raise SpecError.of([FieldProblem(field="rig.imaging_lens", expected=f"one of {known}", got=repr(name))])
    return IMAGING_LENSES[name]
