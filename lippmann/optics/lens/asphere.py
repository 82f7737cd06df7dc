"""Rotationally symmetric aspheres: their sag, their slope and their intersection with rays.

The sag of an even asphere of curvature c, conic constant k and terms a_4, a_6, ... at a distance r from the axis is

    z(r) = c r^2 / (1 + sqrt(1 - (1 + k) c^2 r^2)) + a_4 r^4 + a_6 r^6 + ...

(ISO 10110-12; k = 0 is a sphere, -1 a paraboloid, below -1 a hyperboloid).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from lippmann.lattice.arrays import NUMPY, Arrays
from lippmann.optics.lens.ray import Ray, Vector

STEPS = 30
"""The most steps of Newton's method, which doubles the correct digits in each step; a ray that needs more has no
intersection."""

SETTLED_MM = 1e-7
"""The greatest error before the last step, which squares it."""

CLOSE_MM = 1e-9
"""The distance from the surface within which a point counts as a crossing."""


@dataclass(frozen=True)
class Profile:
    """The form of a surface of rotation."""

    curvature_per_mm: float
    conic: float = 0.0
    aspheric: tuple[float, ...] = ()
    """The coefficients of r^4, r^6, ..."""

    def sag_mm(self, square_mm2: Any, xp: Arrays = NUMPY) -> Any:
        """Return the sag at squared distances from the axis, same shape; NaN beyond the rim of the surface.

        Parameters
        ----------
        square_mm2
            The squared distances from the axis, mm^2.
        xp
            The library of the arrays.

        Examples
        --------
        >>> paraboloid = Profile(0.02, conic=-1.0, aspheric=(1e-4,))
        >>> paraboloid.sag_mm(np.array([100.0])).tolist()  # c r^2 / 2 + a_4 r^4
        [2.0]
        """
        sag = self.curvature_per_mm * square_mm2 / (1.0 + self._root(square_mm2, xp))
        power = square_mm2
        for term in self.aspheric:
            power = power * square_mm2
            sag = sag + term * power
        return sag

    def steepness_per_mm(self, square_mm2: Any, xp: Arrays = NUMPY) -> Any:
        """Return dz/d(r^2) at squared distances from the axis, same shape.

        Parameters
        ----------
        square_mm2
            The squared distances from the axis, mm^2.
        xp
            The library of the arrays.
        """
        with np.errstate(divide="ignore"):
            steepness = self.curvature_per_mm / 2.0 / self._root(square_mm2, xp)
        power = square_mm2
        for order, term in enumerate(self.aspheric, start=2):
            steepness = steepness + order * term * power
            power = power * square_mm2
        return steepness

    def just_within(self, square_mm2: Any, xp: Arrays = NUMPY) -> Any:
        """Return squared distances brought back inside the rim where an ellipsoid ends.

        Parameters
        ----------
        square_mm2
            The squared distances from the axis, mm^2.
        xp
            The library of the arrays.
        """
        bulge = (1.0 + self.conic) * self.curvature_per_mm**2
        return square_mm2 if bulge <= 0 else xp.minimum(square_mm2, 0.999 / bulge)

    def _root(self, square_mm2: Any, xp: Arrays) -> Any:
        inside = 1.0 - (1.0 + self.conic) * self.curvature_per_mm**2 * square_mm2
        return xp.sqrt(xp.where(inside >= 0, inside, math.nan))


def meet_profile(ray: Ray, profile: Profile, *, vertex_z_mm: float, xp: Arrays = NUMPY) -> tuple[Vector, Vector]:
    """Return the intersections of rays with a surface of rotation, and the unit normals toward +z.

    Newton's method along the ray starts at its intersection with the vertex plane (Spencer, Murty, J. Opt. Soc. Am. 52,
    672 (1962)). Rays that leave the surface's domain or do not settle become NaN.

    Parameters
    ----------
    ray
        The rays.
    profile
        The sag and the slope of the surface over the distance from the axis.
    vertex_z_mm
        The place of the vertex along the axis, mm.
    xp
        The library of the arrays.
    """

    def step(along: Any) -> tuple[Any, Any]:
        x, y, z = ray.at(along)
        square = profile.just_within(x * x + y * y, xp)
        miss = z - vertex_z_mm - profile.sag_mm(square, xp)
        across = 2.0 * (x * dx + y * dy)
        return along - miss / (dz - profile.steepness_per_mm(square, xp) * across), abs(miss) > SETTLED_MM

    dx, dy, dz = ray.direction
    with np.errstate(invalid="ignore", over="ignore"):
        along = xp.settle(step, (vertex_z_mm - ray.position[2]) / dz, most=STEPS)
        x, y, z = ray.at(along)
        square = x * x + y * y
        is_met = abs(z - vertex_z_mm - profile.sag_mm(square, xp)) < CLOSE_MM
        x, y, z = (xp.where(is_met, value, math.nan) for value in (x, y, z))
        slope = -2.0 * profile.steepness_per_mm(x * x + y * y, xp)
        nx, ny = slope * x, slope * y
        length = xp.sqrt(nx * nx + ny * ny + 1.0)
        return (x, y, z), (nx / length, ny / length, 1.0 / length)
