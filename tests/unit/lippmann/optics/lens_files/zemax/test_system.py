"""Aperture and field in the head of a Zemax file."""

from __future__ import annotations

import math

import pytest

from lippmann.optics.lens_files.system import Aperture, FieldPoint, System
from lippmann.optics.lens_files.zemax.lines import read_blocks
from lippmann.optics.lens_files.zemax.system import system_of


def system(head: str) -> System:
    return system_of(read_blocks(head)[0], object_mm=math.inf, mm=10.0)


@pytest.mark.parametrize(
    ("head", "aperture"),
    [
        ("ENPD 2.5", Aperture("entrance pupil", 25.0)),
        ("FNUM 4.5 0", Aperture("f-number", 4.5)),
        ("FNUM 4.5 1", Aperture("working f-number", 4.5)),
        ("FNUM 4.5", Aperture("f-number", 4.5)),
        ("OBNA 0.15 0", Aperture("object aperture", 0.15)),
        ("OBNA 15 1", Aperture("object cone", 15)),
        ("FLOA", Aperture("stop")),
        ("ENPD 0\nFNUM 2", Aperture("f-number", 2.0)),
        ("ENPD much", None),
        ("", None),
    ],
)
def test_the_aperture_is_in_mm_or_a_ratio(head: str, aperture: Aperture | None) -> None:
    assert system(head).aperture == aperture


@pytest.mark.parametrize(
    ("head", "fields"),
    [
        ("FTYP 0 0 3 1\nYFLN 0 14 20 0 0 0", [FieldPoint("angle", value) for value in (0, 14, 20)]),
        ("FTYP 1 0 2 1\nXFLN 0 3\nYFLN 0 4", [FieldPoint("object height", value) for value in (0, 50)]),
        ("FTYP 2 0 1 1\nYFLN 2", [FieldPoint("image height", 20)]),
        ("FTYP 3 0 1 1\nYFLN 2", [FieldPoint("image height", 20)]),
        ("FTYP 0 0 2 1\nYFLD 1 0\nYFLD 2 14", [FieldPoint("angle", value) for value in (0, 14)]),
        ("FTYP 0 0 1\nYFLN 14\nVDYN 0.1\nVCYN 0.3", [FieldPoint("angle", 14, 0.1 - 0.7, 0.1 + 0.7)]),
        ("FTYP 0 0 1\nXFLN 14\nVDYN 0.1\nVCYN 0.3", [FieldPoint("angle", 14)]),
        ("FTYP 9 0 1\nYFLN 14", [FieldPoint("angle", 14)]),
        ("", []),
    ],
)
def test_fields_are_angles_or_heights_with_the_part_of_the_pupil_that_is_used(
    head: str, fields: list[FieldPoint]
) -> None:
    assert list(system(head).fields) == fields
