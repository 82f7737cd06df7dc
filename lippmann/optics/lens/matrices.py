"""Ray-transfer matrices, which describe a lens system near its axis.

A ray is (height, angle) and a matrix [[A, B], [C, D]] acts on it from the left (Kogelnik, Li, Appl. Opt. 5, 1550
(1966)); between media in air the determinant is 1 and the focal length -1 / C.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lippmann.optics.lens.surfaces import ImagingLens, Surface

_IN_FOCUS = 1e-12
"""The greatest |D| of an object plane that counts as the front focal plane."""


@dataclass(frozen=True)
class CardinalPoints:
    """The focal length and the focal distances of a lens system in air, mm."""

    effective_focal_length_mm: float
    back_focal_distance_mm: float
    """The distance from the last vertex to the rear focal point."""
    front_focal_distance_mm: float
    """The distance from the first vertex to the front focal point, positive when it lies behind the vertex."""


@dataclass(frozen=True)
class Conjugate:
    """An object plane and its image."""

    object_mm: float
    """The distance from the object to the first vertex."""
    image_mm: float
    """The distance from the last vertex to the image; infinite for an object in the front focal plane."""
    magnification: float
    """The lateral magnification; negative if the image is inverted."""


def translation(distance_mm: float) -> NDArray[np.float64]:
    """Return the matrix of the propagation through a distance."""
    return np.array([[1.0, distance_mm], [0.0, 1.0]])


def refraction(surface: Surface, index_before: float) -> NDArray[np.float64]:
    """Return the matrix of a refraction; angles on both sides are not reduced.

    Parameters
    ----------
    surface
        The surface.
    index_before
        The index of refraction before the surface.
    """
    ratio = index_before / surface.index_after
    return np.array([[1.0, 0.0], [(ratio - 1.0) * surface.curvature_per_mm, ratio]])


def system_matrix(lens: ImagingLens) -> NDArray[np.float64]:
    """Return the matrix from the first vertex to the last, shape (2, 2)."""
    matrix, index = np.eye(2), 1.0
    for surface in lens.surfaces:
        matrix = translation(surface.thickness_mm) @ refraction(surface, index) @ matrix
        index = surface.index_after
    return matrix


def matrix_to(lens: ImagingLens, z_mm: float) -> NDArray[np.float64]:
    """Return the matrix from the first vertex to a plane across the axis, in the medium there, shape (2, 2).

    A plane before the first vertex is reached by going back, as an observer of the entrance pupil does.

    Parameters
    ----------
    lens
        The imaging lens.
    z_mm
        The place of the plane behind the first vertex, mm.
    """
    matrix, index, here_mm = np.eye(2), 1.0, 0.0
    for surface, vertex_mm in zip(lens.surfaces, lens.vertices_mm, strict=True):
        if vertex_mm > z_mm:
            break
        matrix = refraction(surface, index) @ translation(vertex_mm - here_mm) @ matrix
        index, here_mm = surface.index_after, vertex_mm
    return translation(z_mm - here_mm) @ matrix


def cardinal_points(lens: ImagingLens) -> CardinalPoints:
    """Return the focal length and focal distances.

    >>> from lippmann.optics.lens.published import ATHINEOS_2006
    >>> round(cardinal_points(ATHINEOS_2006).effective_focal_length_mm, 6)
    300.467846
    """
    (a, _), (c, d) = system_matrix(lens)
    return CardinalPoints(
        effective_focal_length_mm=float(-1 / c),
        back_focal_distance_mm=float(-a / c),
        front_focal_distance_mm=float(d / c),
    )


def conjugate(lens: ImagingLens, object_mm: float) -> Conjugate:
    """Return the image of an object plane at a distance in front of the first vertex.

    The image lies where the element B of (propagation to image) x system x (propagation from object) vanishes; the
    element A is then the magnification.

    Parameters
    ----------
    lens
        The imaging lens.
    object_mm
        The distance of the object plane before the first vertex, mm.
    """
    (a, b), (c, d) = system_matrix(lens) @ translation(object_mm)
    if abs(d) < _IN_FOCUS:
        return Conjugate(object_mm=object_mm, image_mm=float("inf"), magnification=float("-inf"))
    image_mm = -b / d
    return Conjugate(object_mm=object_mm, image_mm=float(image_mm), magnification=float(a + image_mm * c))
