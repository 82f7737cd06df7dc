"""Rotationally symmetric aspheres: their sag, their slope and their intersection with rays.

The sag of an even asphere of curvature c, conic constant k and terms a_4, a_6, ... at a distance r from the axis is

    z(r) = c r^2 / (1 + sqrt(1 - (1 + k) c^2 r^2)) + a_4 r^4 + a_6 r^6 + ...

(ISO 10110-12; k = 0 is a sphere, -1 a paraboloid, below -1 a hyperboloid).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

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

    def sag_mm(self, square_mm2: Array) -> Array:
        """Return the sag at squared distances from the axis, same shape; NaN beyond the rim of the surface.

        >>> paraboloid = Profile(0.02, conic=-1.0, aspheric=(1e-4,))
        >>> paraboloid.sag_mm(np.array([100.0])).tolist()  # c r^2 / 2 + a_4 r^4
        [2.0]
        """
        sag: Array = self.curvature_per_mm * square_mm2 / (1.0 + self._root(square_mm2))
        for order, term in enumerate(self.aspheric, start=2):
            sag = sag + term * square_mm2**order
        return sag

    def steepness_per_mm(self, square_mm2: Array) -> Array:
        """Return dz/d(r^2) at squared distances from the axis, same shape."""
        with np.errstate(divide="ignore"):
            steepness: Array = self.curvature_per_mm / 2.0 / self._root(square_mm2)
        for order, term in enumerate(self.aspheric, start=2):
            steepness = steepness + order * term * square_mm2 ** (order - 1)
        return steepness

    def just_within(self, square_mm2: Array) -> Array:
        """Return squared distances brought back inside the rim where an ellipsoid ends."""
        bulge = (1.0 + self.conic) * self.curvature_per_mm**2
        return square_mm2 if bulge <= 0 else np.minimum(square_mm2, 0.999 / bulge)

    def _root(self, square_mm2: Array) -> Array:
        inside = 1.0 - (1.0 + self.conic) * self.curvature_per_mm**2 * square_mm2
        root: Array = np.sqrt(np.where(inside >= 0, inside, np.nan))
        return root


def meet_profile(position: Array, direction: Array, profile: Profile, *, vertex_z_mm: float) -> tuple[Array, Array]:
    """Return the intersections of rays with a surface of rotation, and the unit normals toward +z, each (..., 3).

    Newton's method along the ray starts at its intersection with the vertex plane (Spencer, Murty, J. Opt. Soc. Am. 52,
    672 (1962)). Rays that leave the surface's domain or do not settle become NaN.

    Parameters
    ----------
    position
        The points where the rays start, float64 (..., 3), mm.
    direction
        The unit vectors of the rays, float64 (..., 3).
    profile
        The sag and the slope of the surface over the distance from the axis.
    vertex_z_mm
        The place of the vertex along the axis, mm.
    """
    step = (vertex_z_mm - position[..., 2]) / direction[..., 2]
    with np.errstate(invalid="ignore", over="ignore"):
        for _ in range(STEPS):
            points = position + step[..., np.newaxis] * direction
            square = profile.just_within(_square(points))
            miss = points[..., 2] - vertex_z_mm - profile.sag_mm(square)
            across = 2.0 * np.sum(points[..., :2] * direction[..., :2], axis=-1)
            step = step - miss / (direction[..., 2] - profile.steepness_per_mm(square) * across)
            if not np.any(np.abs(miss) > SETTLED_MM):
                break
        points = position + step[..., np.newaxis] * direction
        miss = points[..., 2] - vertex_z_mm - profile.sag_mm(_square(points))
        points = np.where((np.abs(miss) < CLOSE_MM)[..., np.newaxis], points, np.nan)
        return points, _normals(points, profile)


def _square(points: Array) -> Array:
    square: Array = np.sum(points[..., :2] ** 2, axis=-1)
    return square


def _normals(points: Array, profile: Profile) -> Array:
    normals = np.empty_like(points)
    normals[..., :2] = -2.0 * profile.steepness_per_mm(_square(points))[..., np.newaxis] * points[..., :2]
    normals[..., 2] = 1.0
    scaled: Array = normals / np.linalg.norm(normals, axis=-1, keepdims=True)
    return scaled
