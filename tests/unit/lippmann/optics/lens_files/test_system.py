"""Aperture, field and object of a lens file."""

from __future__ import annotations

import math

import pytest

from lippmann.optics.lens_files.system import Aperture, ApertureKind, System, ignored_notes


@pytest.mark.parametrize(
    ("kind", "value", "slope"),
    [
        ("working f-number", 4.0, 0.125),
        ("image aperture", 0.6, 0.75),
        ("object aperture", 0.8, 4 / 3),
        ("object cone", 45.0, 1.0),
    ],
)
def test_an_aperture_gives_the_slope_of_the_marginal_ray(kind: ApertureKind, value: float, slope: float) -> None:
    assert Aperture(kind, value).slope == pytest.approx(slope)


@pytest.mark.parametrize(
    ("kind", "value"),
    [("working f-number", 0.0), ("image aperture", 1.0), ("object cone", 90.0), ("stop", 1.0), ("f-number", 4.0)],
)
def test_other_apertures_give_none(kind: ApertureKind, value: float) -> None:
    assert math.isnan(Aperture(kind, value).slope)


def test_an_object_is_far_on_either_side() -> None:
    assert all(System(object_mm=sign * mm).is_far for sign in (1, -1) for mm in (1e9, math.inf))
    assert not System(object_mm=-1000.0).is_far


def test_visible_light_at_room_temperature_needs_no_note() -> None:
    assert list(ignored_notes(wavelength_um=0.0, temperature_c=None)) == []
    assert list(ignored_notes(wavelength_um=0.55, temperature_c=20.0)) == []
    assert len(list(ignored_notes(wavelength_um=0.9, temperature_c=21.0))) == 2
