"""One lens of the array: a plano-convex lens cut from a sphere by its cell.

The flat side faces the scene and lies in the MLA plane; the convex side faces the camera.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from lippmann.errors import FieldProblem, OpticsError
from lippmann.job.optics.rig import LensArray


@dataclass(frozen=True)
class Microlens:
    """The shape of one lens, mm."""

    radius_mm: float
    """R = (index - 1) f (Athineos 2006, equation 1)."""
    displacement_mm: float
    """The distance from the sphere's centre to the flat side."""

    @property
    def thickness_mm(self) -> float:
        """The distance from the flat side to the vertex."""
        return self.radius_mm - self.displacement_mm


def rim_radius_mm(array: LensArray) -> float:
    """Return the radius of the circle where the sphere meets the flat side.

    The circle of `full` passes through the corners of the cell, so that glass covers the whole cell; for hexagons this
    is equation (3) of Athineos 2006. The circle of `inscribed` is inside the cell, which is equation (2) of the paper,
    printed for squares; it leaves the corners (21.5 % of a square cell, 9.3 % of a hexagonal one) without glass.
    """
    if array.aperture == "inscribed":
        return array.pitch_mm / 2
    return array.pitch_mm * array.lenses_mm.cell.corner_radius


def microlens(array: LensArray) -> Microlens:
    """Return the shape of the lenses of an array.

    Raises
    ------
    OpticsError
        If the cell is wider than the sphere it is cut from.

    Examples
    --------
    >>> shape = microlens(LensArray())
    >>> round(shape.radius_mm, 3), round(shape.displacement_mm, 6)
    (1.617, 1.454197)
    """
    radius_mm = (array.index - 1.0) * array.focal_length_mm
    rim_mm = rim_radius_mm(array)
    if rim_mm >= radius_mm:
        raise OpticsError.of(
            [
                FieldProblem(
                    field="rig.lens_array.pitch_mm",
                    expected=f"a pitch whose rim circle of {rim_mm:.4g} mm is below the radius (index - 1) x "
                    f"focal_length_mm = {radius_mm:.4g} mm",
                    got=f"{array.pitch_mm:g} mm",
                )
            ]
        )
    return Microlens(radius_mm=radius_mm, displacement_mm=math.sqrt(radius_mm**2 - rim_mm**2))
