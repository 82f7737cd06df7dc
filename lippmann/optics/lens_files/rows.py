"""The rows of lens design files: surfaces, some of which are only the stop or a plane in air."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import accumulate
from typing import Any

from pydantic import ValidationError

from lippmann.errors import FieldProblem, SpecError
from lippmann.job.fields.problems import problems_of
from lippmann.job.optics.lens import MAX_SURFACES, LensSurface, Prescription
from lippmann.optics.lens.surfaces import Surface
from lippmann.optics.lens_files.lens_file import LensFile, in_file, without_stop_in_glass
from lippmann.optics.lens_files.rims import with_rims_apart

PLANE_MM = 1e7
"""The least radius of a plane: some programs write one as 1e18, and optimisers as a curvature of 1e-17. A face of that
radius has a focal length of more than 10 km, and counts as one without power."""
TOUCHING_MM = 1e-6
"""The greatest distance of a stop from a vertex at which it stands."""


@dataclass(frozen=True)
class Row:
    """One surface of a file, and its location in the file."""

    place: str
    """The words that name the row in a message, for example `line 7`."""
    surface: dict[str, Any] = field(default_factory=dict)
    """The fields of a `LensSurface`; a row that is only a plane in air needs no aperture."""
    is_stop: bool = False
    may_shrink: bool = False
    """True if a program computed the semi-diameter from rays, and its user did not set it."""


def radius_or_plane(radius_mm: float) -> float | None:
    """Return a radius of curvature, or None for a plane.

    >>> radius_or_plane(-50.0), radius_or_plane(1e18)
    (-50.0, None)
    """
    return radius_mm if abs(radius_mm) < PLANE_MM else None


def prescription_of_rows(
    rows: Sequence[Row], *, title: str = "", source: str = "", notes: Sequence[str] = ()
) -> LensFile:
    """Return the lens that the rows of a file describe.

    Planes with air on both sides are no surfaces; their thickness is added to that of the surface before. The row of
    the stop is the position of a variable stop; on a surface of glass, the stop is in the air beside the rim of that
    surface. A stop that would stand in glass is left out, with a note.

    Parameters
    ----------
    rows
        The rows of the file, from the object to the image.
    title
        The title of the lens.
    source
        The publication that the lens is from.
    notes
        The notes of the reader.

    Raises
    ------
    SpecError
        The error names the invalid rows.
    """
    kept: list[tuple[Row, float]] = []
    stops: list[tuple[Row, float]] = []
    z_mm = 0.0
    for row, empty, index_before in with_media(rows):
        # Only the distance to the next surface counts: a plane in air between them may lie outside of it.
        bare = replace(row, surface=row.surface | {"thickness_mm": 0.0})
        shape = row if empty else replace(row, surface=_surface(bare).model_dump())
        if row.is_stop:
            stops.append((shape, z_mm if empty else z_mm + _beside_rim_mm(shape, index_before)))
        if not empty:
            kept.append((shape, z_mm))
        z_mm += row.surface.get("thickness_mm", 0.0)
    if len(stops) > 1:
        expected = f"one stop; {stops[0][0].place} has it"
        raise SpecError.of([FieldProblem(field=stops[1][0].place, expected=expected, got="another stop")])
    prescription = _prescription(kept, stops[0][1] if stops else None, title=title, source=source)
    file = LensFile(prescription, tuple(row.place for row, _ in kept), tuple(notes))
    file = with_rims_apart(file, [row.may_shrink for row, _ in kept])
    return without_stop_in_glass(file, stops[0][0].place if stops else "")


def with_media(rows: Sequence[Row]) -> Iterator[tuple[Row, bool, float]]:
    """Yield every row, whether it is only a plane in air, and the index before it.

    The index behind a row whose glass is only named counts as that of some glass.
    """
    index_before = 1.0
    for row in rows:
        empty = _is_empty(row, index_before)
        yield row, empty, index_before
        if not empty:
            index_before = row.surface.get("index") or (0.0 if row.surface.get("material") else 1.0)


def _is_empty(row: Row, index_before: float) -> bool:
    surface = row.surface
    has_shape = surface.get("radius_mm") is not None or surface.get("conic") or surface.get("aspheric")
    is_air = surface.get("material") is None and surface.get("index", 1.0) == 1.0
    return not has_shape and is_air and index_before == 1.0


def _surface(row: Row) -> LensSurface:
    try:
        return LensSurface.model_validate(row.surface)
    except ValidationError as error:
        raise SpecError.of(
            FieldProblem(field=f"{row.place}, {problem.field}", expected=problem.expected, got=problem.got)
            for problem in problems_of(error)
        ) from error


def _beside_rim_mm(row: Row, index_before: float) -> float:
    """Return the distance behind its vertex at which a plane touches a surface of glass from the side of the air."""
    shape = row.surface
    radius_mm = float("inf") if shape["radius_mm"] is None else shape["radius_mm"]
    aperture_mm = shape["semi_aperture_mm"]
    sag_mm = Surface(radius_mm, 0.0, 1.0, aperture_mm, shape["conic"], tuple(shape["aspheric"])).sag_mm(aperture_mm)
    return max(0.0, sag_mm) if shape["index"] == 1.0 and index_before != 1.0 else min(0.0, sag_mm)


def _prescription(
    kept: Sequence[tuple[Row, float]], stop_z_mm: float | None, *, title: str, source: str
) -> Prescription:
    if not kept:
        raise SpecError("expected a lens of at least two surfaces, got none")
    if len(kept) > MAX_SURFACES:
        raise SpecError(f"expected a lens of at most {MAX_SURFACES} surfaces, got {len(kept)}")
    ends_mm = [z_mm for _, z_mm in kept[1:]] + [kept[-1][1]]
    first_mm = kept[0][1]
    surfaces = [
        {**row.surface, "thickness_mm": round(end_mm - z_mm, 9)}
        for (row, z_mm), end_mm in zip(kept, ends_mm, strict=True)
    ]
    vertices_mm = list(accumulate((surface["thickness_mm"] for surface in surfaces[:-1]), initial=0.0))
    stop = None if stop_z_mm is None else _at_vertex(round(stop_z_mm - first_mm, 9), vertices_mm)
    try:
        return Prescription.model_validate({"title": title, "source": source, "surfaces": surfaces, "stop_z_mm": stop})
    except ValidationError as error:
        raise SpecError.of(in_file(problems_of(error), [row.place for row, _ in kept])) from error


def _at_vertex(z_mm: float, vertices_mm: Sequence[float]) -> float:
    """Return a position, or that of the vertex where it is but for rounding."""
    nearest_mm = min(vertices_mm, key=lambda vertex_mm: abs(vertex_mm - z_mm))
    return nearest_mm if abs(nearest_mm - z_mm) < TOUCHING_MM else z_mm
