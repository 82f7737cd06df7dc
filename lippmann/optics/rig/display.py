"""The display: lenses over a print or a panel, and the view of an eye in front of them.

A gap is the distance from the pixels to the lenses. The *physical* gap includes the substrate; the *reduced* gap is
g = t / index + air, the equivalent distance in air. All formulas use the reduced gap. Depths are measured as `s_mm`,
positive in front of the display.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

LEAST_MAGNIFICATION = 1.0
"""The least depth of a real image in focal lengths: at 2 f, pixels are shown at their own size."""


def reduced_gap_mm(physical_mm: float, *, substrate_mm: float, index: float) -> float:
    """Return the reduced gap: the thickness of the substrate divided by its index, plus the air above it.

    Parameters
    ----------
    physical_mm
        The physical gap as built, substrate included, mm.
    substrate_mm
        The thickness of the substrate, mm.
    index
        The index of refraction of the substrate.

    Examples
    --------
    >>> round(reduced_gap_mm(4.8, substrate_mm=3.3, index=1.49), 5)
    3.71477
    """
    glass_mm = min(physical_mm, substrate_mm)
    return glass_mm / index + (physical_mm - glass_mm)


def physical_gap_mm(reduced_mm: float, *, substrate_mm: float, index: float) -> float:
    """Return the physical gap; the inverse of `reduced_gap_mm`.

    Parameters
    ----------
    reduced_mm
        The reduced gap, mm.
    substrate_mm
        The thickness of the substrate, mm.
    index
        The index of refraction of the substrate.

    Examples
    --------
    >>> round(physical_gap_mm(3.3, substrate_mm=3.3, index=1.49), 3)
    4.385
    """
    glass_mm = min(reduced_mm * index, substrate_mm)
    return glass_mm + (reduced_mm - glass_mm / index)


def central_depth_plane_mm(*, focal_length_mm: float, gap_mm: float) -> float:
    """Return the depth l at which the lenses image the pixels, 1 / f = 1 / g + 1 / l; infinite at g = f.

    Parameters
    ----------
    focal_length_mm
        The focal length of the lenses, mm.
    gap_mm
        The reduced gap between pixels and lenses, mm.

    Examples
    --------
    >>> round(central_depth_plane_mm(focal_length_mm=3.3, gap_mm=4.8 - 3.3 + 3.3 / 1.49), 3)
    29.556
    """
    beyond_mm = gap_mm - focal_length_mm
    # The gap is equal to the focal length within rounding: light leaves the lenses parallel.
    if abs(beyond_mm) <= 1e-12 * focal_length_mm:
        return math.inf
    return focal_length_mm * gap_mm / beyond_mm


def gap_of_plane_mm(*, focal_length_mm: float, plane_mm: float) -> float:
    """Return the reduced gap for a central depth plane; the inverse of `central_depth_plane_mm`.

    Parameters
    ----------
    focal_length_mm
        The focal length of the lenses, mm.
    plane_mm
        The depth of the central depth plane, positive before the lenses, mm; infinite for parallel light.

    Raises
    ------
    ValueError
        If the plane is less than a focal length before the lenses, which no gap can achieve.
    """
    if math.isinf(plane_mm):
        return focal_length_mm
    if 0 <= plane_mm <= focal_length_mm:
        raise ValueError(f"expected a plane behind the lenses or over {focal_length_mm:g} mm before, got {plane_mm:g}")
    return focal_length_mm * plane_mm / (plane_mm - focal_length_mm)


def chosen_gap_mm(shallow_mm: float, deep_mm: float, *, focal_length_mm: float, contact_mm: float) -> float:
    """Return the reduced gap for a range of depths of one sign.

    The central depth plane is in the middle of the range, but at least 2 f before the lenses; the gap is never smaller
    than `contact_mm`, the reduced thickness of the substrate. For an empty range the lenses send parallel light.

    Parameters
    ----------
    shallow_mm
        The depth that is nearer to the lenses, mm.
    deep_mm
        The depth that is farther from the lenses, mm, of the same sign.
    focal_length_mm
        The focal length of the lenses, mm.
    contact_mm
        The least reduced gap, mm: the reduced thickness of the substrate.
    """
    if shallow_mm == deep_mm == 0:
        return max(focal_length_mm, contact_mm)
    plane_mm = (shallow_mm + deep_mm) / 2
    if plane_mm > 0:
        plane_mm = max(plane_mm, (1 + LEAST_MAGNIFICATION) * focal_length_mm)
    return max(gap_of_plane_mm(focal_length_mm=focal_length_mm, plane_mm=plane_mm), contact_mm)


def viewing_angle_deg(*, pitch_mm: float, gap_mm: float) -> float:
    """Return the full angle in which a lens shows its own cell, 2 atan(p / 2 g).

    Parameters
    ----------
    pitch_mm
        The pitch of the lenses, mm.
    gap_mm
        The reduced gap between pixels and lenses, mm.

    Examples
    --------
    >>> round(viewing_angle_deg(pitch_mm=1.0, gap_mm=3.3), 2)
    17.23
    """
    return math.degrees(2 * math.atan(pitch_mm / (2 * gap_mm)))


def viewing_zone_mm(*, pitch_mm: float, gap_mm: float, distance_mm: float, apart_mm: float = 0.0) -> float:
    """Return the width of the zone at a distance in which every lens shows its own cell: p L / g for one lens.

    Parameters
    ----------
    pitch_mm
        The pitch of the lenses, mm.
    gap_mm
        The reduced gap between pixels and lenses, mm.
    distance_mm
        The distance of the eye from the lenses, mm.
    apart_mm
        The distance between the axes of the outermost lenses that must all show their own cells, mm. Cells and lenses
        have the same pitch, so the zones of lenses are as far apart as the lenses.
    """
    return max(0.0, pitch_mm * distance_mm / gap_mm - apart_mm)


@dataclass(frozen=True)
class Resolvable:
    """The depths between which a display can show as much detail as it has lenses."""

    front_mm: float
    """The greatest depth in front of the display."""
    back_mm: float
    """The greatest depth behind the display, as a positive length; infinite if there is no limit."""


def resolvable_depth_mm(*, pitch_mm: float, gap_mm: float, pixel_mm: float, distance_mm: float) -> Resolvable:
    """Return the depths that a display can resolve: H. Hoshino, F. Okano, H. Isono, I. Yuyama, JOSA A 15, 2059 (1998).

    A lens projects a pixel P as an angle P / g, and at a viewing distance L no detail finer than the pitch p comes
    through: z_front = g p L / (L P + g p), z_back = g p L / (L P - g p).

    Parameters
    ----------
    pitch_mm
        The pitch of the lenses, mm.
    gap_mm
        The reduced gap between pixels and lenses, mm.
    pixel_mm
        The pitch of the pixels, mm.
    distance_mm
        The distance of the eye from the lenses, mm.

    Examples
    --------
    >>> found = resolvable_depth_mm(pitch_mm=1.0, gap_mm=3.3, pixel_mm=25.4 / 600, distance_mm=1000.0)
    >>> round(found.front_mm, 1), round(found.back_mm, 1)
    (72.3, 84.5)
    """
    area, spread = gap_mm * pitch_mm, distance_mm * pixel_mm
    back_mm = area * distance_mm / (spread - area) if spread > area else math.inf
    return Resolvable(front_mm=area * distance_mm / (spread + area), back_mm=back_mm)
