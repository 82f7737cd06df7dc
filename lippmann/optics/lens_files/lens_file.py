"""The lens of a file: its prescription, the file's own names of its surfaces, and notes."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

from lippmann.errors import FieldProblem, OpticsError, SpecError
from lippmann.job.optics.lens import Prescription
from lippmann.optics.lens.check import check_lens, stop_fault
from lippmann.optics.lens.prescription import lens_of

_SURFACE = re.compile(r"(?:rig\.imaging_lens\.)?surfaces\.(\d+)\.?(.*)")


@dataclass(frozen=True)
class LensFile:
    """The lens of a file."""

    prescription: Prescription
    places: tuple[str, ...] = ()
    """The file's own name of each surface of the prescription, for example `line 12, SURF 3`."""
    notes: tuple[str, ...] = ()
    """Notes on values that were read otherwise than they stand in the file, or computed because it has none."""


def in_file(problems: Iterable[FieldProblem], places: Sequence[str]) -> list[FieldProblem]:
    """Return problems of a prescription with the file's names of the surfaces.

    Parameters
    ----------
    problems
        The problems.
    places
        The file's names of the surfaces.

    Examples
    --------
    >>> problem = FieldProblem(field="surfaces.0.thickness_mm", expected="glass", got="0 mm")
    >>> str(in_file([problem], ["line 7"])[0])
    'line 7, thickness_mm: expected glass, got 0 mm'
    """
    return [
        FieldProblem(field=_named(problem.field, places), expected=problem.expected, got=problem.got)
        for problem in problems
    ]


def _named(field: str, places: Sequence[str]) -> str:
    if field == "rig.imaging_lens":
        return "(whole)"
    found = _SURFACE.fullmatch(field)
    if found is None or int(found[1]) >= len(places):
        return field.removeprefix("rig.imaging_lens.")
    return ", ".join(part for part in (places[int(found[1])], found[2]) if part)


def without_stop_in_glass(file: LensFile, stop_place: str) -> LensFile:
    """Return the lens of a file without a stop that cannot be built, and a note in its place.

    The stop of a file is a place alone: without an f-number of a job, the rims of the surfaces stop light.

    Parameters
    ----------
    file
        The lens of the file.
    stop_place
        The words that name the stop in the note.
    """
    fault = stop_fault(lens_of(file.prescription))
    if not fault:
        return file
    note = (
        f"{stop_place}: this stop is left out, because it must be in the air{fault}; a stop that a job sets stands in "
        "the widest air space"
    )
    prescription = file.prescription.model_copy(update={"stop_z_mm": None})
    return replace(file, prescription=prescription, notes=(*file.notes, note))


def check_lens_file(file: LensFile) -> None:
    """Check that the lens of a file can be built and transmits light.

    Parameters
    ----------
    file
        The lens of the file.

    Raises
    ------
    OpticsError
        The error names the surfaces as the file does.
    """
    try:
        check_lens(lens_of(file.prescription))
    except SpecError as error:
        raise OpticsError.of(in_file(error.problems, file.places)) from error
