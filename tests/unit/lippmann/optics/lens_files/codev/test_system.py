"""Aperture and field in a CODE V file."""

from __future__ import annotations

import pytest

from lippmann.optics.lens_files.codev.commands import read_commands
from lippmann.optics.lens_files.codev.system import SystemReader
from lippmann.optics.lens_files.system import Aperture, FieldPoint, System


def system(text: str) -> System:
    reader = SystemReader()
    assert all(reader.take(command) for command in read_commands(text))
    return reader.system(object_mm=1000.0, mm=10.0)


@pytest.mark.parametrize(
    ("text", "aperture"),
    [
        ("EPD 2.5", Aperture("entrance pupil", 25.0)),
        ("FNO 4.5", Aperture("working f-number", 4.5)),
        ("NA 0.15", Aperture("image aperture", 0.15)),
        ("nao .15", Aperture("object aperture", 0.15)),
        ("EPD 0; FNO 2", Aperture("working f-number", 2.0)),
        ("EPD 5; FNO 2", Aperture("working f-number", 2.0)),
        ("NAO .15; EPD 2.5; YAN 1", Aperture("entrance pupil", 25.0)),
        ("EPD 2.5; NA .15; EPD 5", Aperture("entrance pupil", 50.0)),
        ("EPD", None),
        ("", None),
    ],
)
def test_the_aperture_is_in_mm_or_a_ratio(text: str, aperture: Aperture | None) -> None:
    assert system(text).aperture == aperture


@pytest.mark.parametrize(
    ("text", "fields"),
    [
        ("YAN 0 14 20", [FieldPoint("angle", value) for value in (0, 14, 20)]),
        ("XOB 0 3; YOB 0 4", [FieldPoint("object height", value) for value in (0, 50)]),
        ("YIM 2", [FieldPoint("image height", 20)]),
        ("YRI 2", [FieldPoint("image height", 20)]),
        ("YAN 0 14; VUY 0 0.3; VLY 0.1 0.2", [FieldPoint("angle", 0, -0.9, 1), FieldPoint("angle", 14, -0.8, 0.7)]),
        ("XAN 14; VUY 0.3", [FieldPoint("angle", 14)]),
        ("", []),
    ],
)
def test_fields_are_angles_or_heights_with_the_part_of_the_pupil_that_is_used(
    text: str, fields: list[FieldPoint]
) -> None:
    assert list(system(text).fields) == fields
