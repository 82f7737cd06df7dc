"""The semi-diameters that a lens file does not give, from its aperture and its field.

Paraxial rays find the entrance pupil; exact rays through it, of every field point, give the height at every surface.
Vignetting factors narrow the bundle of a field point at the stop.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from lippmann.optics.lens.matrices import refraction, translation
from lippmann.optics.lens.surfaces import ImagingLens, Surface
from lippmann.optics.lens.trace import Rays, steps
from lippmann.optics.lens_files.lines import wrong
from lippmann.optics.lens_files.rows import Row, with_media
from lippmann.optics.lens_files.system import FAR_MM, FieldPoint, System

Array = NDArray[np.float64]

MAX_ROWS = 300
"""The greatest number of rows that are traced."""
MAX_FIELDS = 50
SHOWN = 8
"""The surfaces that a note names."""
RAYS = 801
"""The rays of the fan that finds the rim of the stop; rays in between are interpolated to the rim."""
NEAR_RIM = 1e-4
"""The part of a semi-diameter by which a ray may miss a rim, since interpolated rays do not meet it exactly."""
WIDER = 2.0
"""The half width of the fan in entrance pupils, since the pupil of an oblique bundle differs from the paraxial one."""
ROUND_UP_MM = 1e-4


def with_semi_apertures(rows: Sequence[Row], system: System, *, words: str) -> tuple[list[Row], list[str]]:
    """Return the rows with the absent semi-diameters computed, and a note if there were any.

    Parameters
    ----------
    rows
        The rows of the file, with the index of every medium.
    system
        The aperture, the field and the object of the file.
    words
        The words with which a file of the format gives a semi-diameter or an aperture, for messages.

    Raises
    ------
    SpecError
        If the file gives no aperture, or its rays do not pass the lens.
    """
    absent = [
        place
        for place, (row, empty, _) in enumerate(with_media(rows))
        if not empty and "semi_aperture_mm" not in row.surface
    ]
    if not absent:
        return list(rows), []
    first = rows[absent[0]].place
    if system.aperture is None:
        raise wrong(first, f"a semi-diameter, or an aperture of the whole lens ({words})", "neither")
    if len(rows) > MAX_ROWS:
        raise wrong(first, f"a semi-diameter in a lens of more than {MAX_ROWS} rows", "none")
    for row in rows:
        if row.surface.get("index", 1.0) != 1.0 and row.surface["thickness_mm"] < 0:
            got = f"{row.surface['thickness_mm']:g}"
            raise wrong(f"{row.place}, thickness_mm", "glass of a thickness of at least 0", got)
    with np.errstate(all="ignore"):
        heights_mm, lost = _heights_mm(rows, system, first)
    filled = list(rows)
    for place in absent:
        semi_mm = math.ceil(heights_mm[place] / ROUND_UP_MM) * ROUND_UP_MM if heights_mm[place] < 1e6 else math.inf
        if not 0 < semi_mm < math.inf:
            raise wrong(rows[place].place, "a semi-diameter: no ray of the file's aperture arrives here", "none")
        surface = {**rows[place].surface, "semi_aperture_mm": round(semi_mm, 4)}
        filled[place] = replace(rows[place], surface=surface, may_shrink=True)
    which = ", ".join(rows[place].place.rpartition(", ")[2] for place in absent[:SHOWN])
    more = f" and {len(absent) - SHOWN} more" if len(absent) > SHOWN else ""
    field = "" if system.fields else ", for a point on the axis alone, because the file gives no field"
    notes = [f"{which}{more}: the semi-diameter is computed from the rays of the file's aperture{field}"]
    return filled, [*notes, *_lost_notes(lost, system)]


def _lost_notes(lost: Sequence[FieldPoint], system: System) -> Iterator[str]:
    """Yield a note for every reason for which field points are left out."""
    nowhere = [point for point in lost if point.kind == "object height" and system.is_far]
    blocked = [point for point in lost if point not in nowhere]
    reasons = {
        "none of their rays passes the lens": blocked,
        "a height of the object needs a near object, and that of the file is at infinity": nowhere,
    }
    for why, those in reasons.items():
        points = ", ".join(f"{point.value:g} {'degrees' if point.kind == 'angle' else 'mm'}" for point in those[:SHOWN])
        if those:
            yield f"the field points at {points} are left out, because {why}"


def _heights_mm(rows: Sequence[Row], system: System, first: str) -> tuple[Array, list[FieldPoint]]:
    """Return the greatest height of a ray at every row, mm, and the field points none of whose rays passes."""
    lens = _lens(rows)
    stop = next((place for place, row in enumerate(rows) if row.is_stop), 0)
    pupil = _pupil(lens, stop, system, first)
    stop_mm = lens.surfaces[stop].semi_aperture_mm
    greatest: Array = np.zeros(len(rows))
    if not _is_known_stop(system, stop_mm):
        greatest = np.abs(_trace(lens, system, pupil, slope=0.0, heights_mm=np.array([pupil.semi_mm]))[0])
        stop_mm = float(greatest[stop])
        if not np.isfinite(greatest).all():
            lost = rows[int(np.argmin(np.isfinite(greatest)))].place
            raise wrong(lost, "a surface that the marginal ray of the file's aperture passes", "one that it misses")
    left_out: list[FieldPoint] = []
    for point in dict.fromkeys((FieldPoint("angle", 0.0), *system.fields[:MAX_FIELDS])):
        reached = _field_heights_mm(lens, system, pupil, point, stop=stop, stop_mm=stop_mm)
        greatest = np.fmax(greatest, reached)
        if np.isnan(reached).all():
            left_out.append(point)
    return greatest, left_out


def _is_known_stop(system: System, stop_mm: float) -> bool:
    return system.aperture is not None and system.aperture.kind == "stop" and math.isfinite(stop_mm)


@dataclass(frozen=True)
class _Pupil:
    """The paraxial entrance pupil."""

    z_mm: float
    semi_mm: float
    turned: float
    """-1 if the image of the stop in object space is inverted, else 1."""
    whole: Array
    """The matrix of the whole lens, from the first row."""

    @property
    def focal_mm(self) -> float:
        """The focal length."""
        return _focal_mm(self.whole)


def _pupil(lens: ImagingLens, stop: int, system: System, first: str) -> _Pupil:
    to_stop, whole, index = np.eye(2), np.eye(2), 1.0
    for place, surface in enumerate(lens.surfaces):
        if place == stop:
            to_stop = whole
        whole = translation(surface.thickness_mm) @ refraction(surface, index) @ whole
        index = surface.index_after
    a, b = float(to_stop[0, 0]), float(to_stop[0, 1])
    z_mm = float(np.divide(b, a))
    stop_mm = float(np.abs(np.divide(lens.surfaces[stop].semi_aperture_mm, a)))
    semi_mm = _pupil_semi_mm(system, whole, z_mm=z_mm, stop_mm=stop_mm)
    if not (math.isfinite(z_mm) and 0 < semi_mm < math.inf and abs(z_mm) < FAR_MM):
        raise wrong(first, "a semi-diameter: the aperture of the file gives no entrance pupil", "none")
    return _Pupil(z_mm, semi_mm, math.copysign(1.0, a), whole)


def _pupil_semi_mm(system: System, whole: Array, *, z_mm: float, stop_mm: float) -> float:
    """Return half the diameter of the entrance pupil, mm; NaN or infinite if the aperture gives none.

    Parameters
    ----------
    system
        The aperture and the object.
    whole
        The matrix of the whole lens.
    z_mm
        The position of the entrance pupil behind the first row.
    stop_mm
        Half the diameter of the image of the stop in object space.
    """
    aperture = system.aperture
    if aperture is None:
        return math.nan
    if aperture.kind == "entrance pupil":
        return aperture.value / 2
    if aperture.kind == "stop":
        return stop_mm
    if aperture.kind == "f-number":
        return abs(_focal_mm(whole)) / (2 * aperture.value) if aperture.value > 0 else math.nan
    away_mm = abs(system.object_mm + z_mm)
    if aperture.kind in ("object aperture", "object cone"):
        return away_mm * aperture.slope
    if system.is_far:
        return abs(_focal_mm(whole)) * aperture.slope
    return float(away_mm * np.abs(np.divide(aperture.slope, _angular_magnification(whole, system))))


def _focal_mm(whole: Array) -> float:
    return float(-1.0 / whole[1, 0])


def _angular_magnification(whole: Array, system: System) -> float:
    """Return the slope behind the lens by that before it of rays from the axial point of a near object."""
    return float(whole[1, 0] * system.object_mm + whole[1, 1])


def _lens(rows: Sequence[Row]) -> ImagingLens:
    return ImagingLens(
        name="",
        title="",
        source="",
        surfaces=tuple(
            Surface(
                radius_mm=row.surface.get("radius_mm") or math.inf,
                thickness_mm=row.surface.get("thickness_mm", 0.0),
                index_after=row.surface.get("index", 1.0),
                semi_aperture_mm=row.surface.get("semi_aperture_mm", math.inf),
                conic=row.surface.get("conic", 0.0),
                aspheric=tuple(row.surface.get("aspheric", ())),
            )
            for row in rows
        ),
    )


def _field_heights_mm(
    lens: ImagingLens, system: System, pupil: _Pupil, point: FieldPoint, *, stop: int, stop_mm: float
) -> Array:
    """Return the greatest height of the rays of a field point at every row, mm; NaN if none passes."""
    slope = _chief_slope(system, pupil, point)
    if not math.isfinite(slope):
        return np.full(len(lens.surfaces), np.nan)
    least_mm, most_mm = (pupil.turned * limit * stop_mm for limit in (max(-1.0, point.low), min(1.0, point.high)))
    fan_mm = np.linspace(-WIDER, WIDER, RAYS) * pupil.semi_mm
    fan = _trace(lens, system, pupil, slope=slope, heights_mm=fan_mm)
    kept = np.isfinite(fan[:, stop])
    if not kept.any():
        return np.full(len(lens.surfaces), np.nan)
    order = np.argsort(fan[kept, stop])
    at_rims_mm = np.interp([least_mm, most_mm], fan[kept, stop][order], fan_mm[kept][order])
    rays = np.concatenate((fan, _trace(lens, system, pupil, slope=slope, heights_mm=at_rims_mm)))
    low_mm, high_mm = sorted((least_mm, most_mm))
    beyond_mm = NEAR_RIM * stop_mm
    limits_mm = np.array([surface.semi_aperture_mm for surface in lens.surfaces]) * (1 + NEAR_RIM)
    passed = (low_mm - beyond_mm <= rays[:, stop]) & (rays[:, stop] <= high_mm + beyond_mm)
    passed &= np.isfinite(rays).all(axis=1) & (np.abs(rays) <= limits_mm).all(axis=1)
    if not passed.any():
        return np.full(len(lens.surfaces), np.nan)
    greatest: Array = np.abs(rays[passed]).max(axis=0)
    return greatest


def _chief_slope(system: System, pupil: _Pupil, point: FieldPoint) -> float:
    """Return dy / dz of the chief ray before the lens (paraxial, except for angles)."""
    if point.kind == "angle":
        return math.tan(math.radians(point.value)) if abs(point.value) < 89 else math.nan
    if point.kind == "image height" and system.is_far:
        return float(np.divide(point.value, pupil.focal_mm))
    height_mm = point.value
    if point.kind == "image height":
        # The lateral magnification is the inverse of the angular one, since the lens stands in air.
        height_mm *= _angular_magnification(pupil.whole, system)
    return float(np.divide(-height_mm, system.object_mm + pupil.z_mm)) if not system.is_far else math.nan


def _trace(lens: ImagingLens, system: System, pupil: _Pupil, *, slope: float, heights_mm: Array) -> Array:
    """Return the heights at every row of rays that meet the entrance pupil at given heights, (ray, row), mm."""
    start = np.zeros((len(heights_mm), 3))
    start[:, 1], start[:, 2] = heights_mm, pupil.z_mm
    direction = np.zeros_like(start)
    direction[:, 1], direction[:, 2] = slope, 1.0
    if not system.is_far:
        # The rays leave one point of the object; the slope of the chief ray gives its height.
        away_mm = system.object_mm + pupil.z_mm
        direction[:, 1] = slope + heights_mm / away_mm if away_mm else np.nan
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    points = [rays.position for _, rays in steps(Rays(start, direction), lens, stopped=False)]
    heights, along = (np.stack([one[:, axis] for one in points], axis=1) for axis in (1, 2))
    # Light does not go back in glass: there the surfaces have crossed. A plane in air may lie before the last surface.
    is_glass = np.array([surface.index_after != 1.0 for surface in lens.surfaces[:-1]], dtype=bool)
    back = (np.diff(along, axis=1) < 0) & is_glass
    heights[back.any(axis=1)] = np.nan
    return heights
