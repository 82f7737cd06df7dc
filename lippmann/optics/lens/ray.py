"""Rays by their components, for a trace that runs on any library of arrays.

`x`, `y` and `z` are arrays of their own, which is what a compiler of array code needs; `trace.Rays` holds the same
numbers of NumPy as arrays of vectors.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

Vector = tuple[Any, Any, Any]
"""The components x, y and z: arrays that broadcast with each other, or numbers."""


@dataclass(frozen=True)
class Ray:
    """A bundle of rays: one point and the direction of each, in the rig frame."""

    position: Vector
    """The points, mm."""
    direction: Vector
    """The directions, unit vectors."""

    def at(self, along_mm: Any) -> Vector:
        """Return the points at a distance along the rays."""
        (x, y, z), (dx, dy, dz) = self.position, self.direction
        return x + along_mm * dx, y + along_mm * dy, z + along_mm * dz

    def at_z(self, z_mm: Any) -> Vector:
        """Return the intersections with the plane of a z."""
        return self.at((z_mm - self.position[2]) / self.direction[2])


def dot(one: Vector, other: Vector) -> Any:
    """Return the scalar products of vectors.

    Parameters
    ----------
    one, other
        The vectors.
    """
    return one[0] * other[0] + one[1] * other[1] + one[2] * other[2]
