"""Semi-diameters from aperture and field, against rays of the test's own."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from lippmann.errors import SpecError
from lippmann.optics.lens.prescription import lens_of
from lippmann.optics.lens.published import TRONNIER_1954
from lippmann.optics.lens.trace import Rays, through_lens
from lippmann.optics.lens_files.rows import Row, prescription_of_rows
from lippmann.optics.lens_files.semi_apertures import with_semi_apertures
from lippmann.optics.lens_files.system import Aperture, FieldPoint, System

N = 1.5


def row(name: str, radius_mm: float | None, thickness_mm: float, index: float = 1.0, **more: Any) -> Row:
    is_stop = more.pop("is_stop", False)
    fields: dict[str, Any] = {"radius_mm": radius_mm, "thickness_mm": thickness_mm, "index": index, **more}
    return Row(name, fields, is_stop=is_stop)


def plano_convex() -> list[Row]:
    """Return a lens, plane side first, 20 mm behind its stop."""
    return [row("S1", None, 20, is_stop=True), row("S2", None, 5, N), row("S3", -50, 90)]


def semis(rows: list[Row], system: System) -> list[float]:
    return [one.surface.get("semi_aperture_mm", math.nan) for one in with_semi_apertures(rows, system, words="DIAM")[0]]


def height_behind(height_mm: float, slope: float) -> float:
    """Return the height on the sphere of `plano_convex` of a ray with a slope that meets the plane at a height."""
    sine = math.sin(math.atan(slope)) / N
    inside = sine / math.sqrt(1 - sine**2)
    behind_mm = height_mm
    for _ in range(50):
        sag_mm = -50 + math.sqrt(50**2 - behind_mm**2)
        behind_mm = height_mm + inside * (5 + sag_mm)
    return behind_mm


@pytest.mark.parametrize("angle_deg", [0.0, 5.0, 12.0])
def test_the_marginal_ray_of_the_field_gives_the_semi_diameters(angle_deg: float) -> None:
    slope = math.tan(math.radians(angle_deg))
    system = System(Aperture("entrance pupil", 8.0), (FieldPoint("angle", angle_deg),))
    _, front_mm, back_mm = semis(plano_convex(), system)
    assert front_mm == pytest.approx(4 + 20 * slope, abs=1.1e-4)
    assert back_mm == pytest.approx(height_behind(4 + 20 * slope, slope), abs=1.1e-4)
    assert front_mm >= 4 + 20 * slope


@pytest.mark.parametrize(
    "aperture",
    [
        Aperture("entrance pupil", 8.0),
        Aperture("f-number", 12.5),  # f = 50 / 0.5
        Aperture("image aperture", math.sin(math.atan(0.04))),
    ],
)
def test_apertures_of_every_kind_are_the_same(aperture: Aperture) -> None:
    assert semis(plano_convex(), System(aperture))[1] == pytest.approx(4.0, abs=1.1e-4)


NEAR_MM = 180.0
BEHIND_TO_BEFORE = (NEAR_MM + 20 + 5 / N - 100) / 100
"""The slope behind the lens by that before it: f = 100 mm, the first principal point 5 / 1.5 mm behind the plane."""


@pytest.mark.parametrize(
    "aperture",
    [
        Aperture("entrance pupil", 8.0),
        Aperture("f-number", 12.5),
        Aperture("working f-number", NEAR_MM / (8 * BEHIND_TO_BEFORE)),
        Aperture("image aperture", math.sin(math.atan(4 / NEAR_MM * BEHIND_TO_BEFORE))),
        Aperture("object aperture", math.sin(math.atan(4 / NEAR_MM))),
        Aperture("object cone", math.degrees(math.atan(4 / NEAR_MM))),
    ],
)
def test_apertures_of_a_near_object_are_those_of_its_light(aperture: Aperture) -> None:
    found = semis(plano_convex(), System(aperture, object_mm=NEAR_MM))[1]
    assert found == pytest.approx(4.0 * (NEAR_MM + 20) / NEAR_MM, abs=1.1e-4)


def test_an_object_behind_the_lens_is_light_that_converges() -> None:
    system = System(Aperture("entrance pupil", 8.0), object_mm=-100.0)
    assert semis(plano_convex(), system)[1] == pytest.approx(4.0 * 80 / 100, abs=1.1e-4)


@pytest.mark.parametrize("object_mm", [1e13, -1e13, math.inf, -math.inf])
def test_a_distance_of_a_million_kilometres_is_infinite(object_mm: float) -> None:
    system = System(Aperture("working f-number", 12.5), (FieldPoint("image height", 10.0),), object_mm)
    assert semis(plano_convex(), system)[1] == pytest.approx(4 + 20 * 0.1, abs=1.1e-4)


def test_a_known_stop_is_an_aperture() -> None:
    rows = plano_convex()
    rows[0] = row("S1", None, 20, is_stop=True, semi_aperture_mm=3.0)
    assert semis(rows, System(Aperture("stop")))[1] == pytest.approx(3.0, abs=1.1e-4)
    with pytest.raises(SpecError, match="the aperture of the file gives no entrance pupil"):
        semis(plano_convex(), System(Aperture("stop")))


def test_a_near_object_and_its_height_are_a_slope() -> None:
    near = System(Aperture("object aperture", math.sin(math.atan(0.04))), (FieldPoint("object height", 20.0),), 100.0)
    # The chief ray from 20 mm off the axis through the stop at 100 mm, and the rim 4 mm further.
    assert semis(plano_convex(), near)[1] == pytest.approx(4 + 20 * (24 / 100), abs=1.1e-4)


def test_an_image_height_is_an_angle_by_the_focal_length() -> None:
    tall = System(Aperture("entrance pupil", 8.0), (FieldPoint("image height", 10.0),))
    assert semis(plano_convex(), tall)[1] == pytest.approx(4 + 20 * 0.1, abs=1.1e-4)


def test_an_image_height_of_a_near_object_is_its_height_by_the_magnification() -> None:
    system = System(Aperture("entrance pupil", 8.0), (FieldPoint("image height", 10.0),), object_mm=180.0)
    # f = 100 mm with its first principal point 5 / 1.5 mm behind the plane: the object is at twice that distance.
    away_mm = 180 + 20 + 5 / N
    height_mm = 10.0 * (away_mm - 100) / 100
    assert semis(plano_convex(), system)[1] == pytest.approx(4 + 20 * (height_mm + 4) / 180, abs=2e-3)


def test_vignetting_narrows_the_bundle() -> None:
    slope = math.tan(math.radians(10))
    system = System(Aperture("entrance pupil", 8.0), (FieldPoint("angle", 10.0, -1.0, 0.5),))
    assert semis(plano_convex(), system)[1] == pytest.approx(2 + 20 * slope, abs=1.1e-4)


def test_a_lens_with_computed_semi_diameters_passes_its_light_and_no_more() -> None:
    """The rays at the rim of the stop pass, and a rim 2 % smaller stops some of them, surface by surface."""
    rows = []
    for number, one in enumerate(TRONNIER_1954.surfaces, start=1):
        rows.append(row(f"S{number}", one.radius_mm, one.thickness_mm, one.index_after))
        if number == 5:
            rows[-1] = row("S5", one.radius_mm, 5.705, 1.0)
            rows.append(row("stop", None, 4.5, is_stop=True))
    angle_deg = 10.0
    filled, notes = with_semi_apertures(
        rows, System(Aperture("f-number", 2.8), (FieldPoint("angle", angle_deg),)), words="DIAM"
    )
    assert notes == [
        "S1, S2, S3, S4, S5, S6, S7, S8 and 2 more: the semi-diameter is computed from the rays of the file's aperture"
    ]
    lens = lens_of(prescription_of_rows(filled).prescription)
    slope = math.tan(math.radians(angle_deg))
    fan_mm = np.linspace(-14, 14, 4001)
    start = np.stack([np.zeros_like(fan_mm), fan_mm - 30 * slope, np.full_like(fan_mm, -30.0)], axis=1)
    direction = np.broadcast_to(np.array([0, slope, 1]) / math.hypot(1, slope), start.shape)
    passed = np.isfinite(through_lens(Rays(start, direction), lens).direction[:, 2])
    across_mm = float(np.ptp(fan_mm[passed]))
    assert 50 / 2.8 * 0.85 < across_mm < 50 / 2.8 * 1.15


def test_a_field_point_whose_light_does_not_pass_is_said() -> None:
    points = (FieldPoint("angle", 5.0), FieldPoint("angle", 80.0), FieldPoint("image height", 900.0))
    rows, notes = with_semi_apertures(plano_convex(), System(Aperture("entrance pupil", 8.0), points), words="DIAM")
    assert notes[1:] == [
        "the field points at 80 degrees, 900 mm are left out, because none of their rays passes the lens"
    ]
    near = System(Aperture("entrance pupil", 8.0), points[:1])
    assert rows == with_semi_apertures(plano_convex(), near, words="DIAM")[0]


def test_rows_with_semi_diameters_stay_as_they_are() -> None:
    rows = [row("S1", 50, 5, N, semi_aperture_mm=10), row("S2", -50, 90, semi_aperture_mm=10)]
    assert with_semi_apertures(rows, System(), words="DIAM") == (rows, [])


@pytest.mark.parametrize(
    ("rows", "system", "problem"),
    [
        (
            plano_convex(),
            System(),
            "S2: expected a semi-diameter, or an aperture of the whole lens (DIAM), got neither",
        ),
        (plano_convex(), System(Aperture("entrance pupil", 200.0)), "S3: expected a surface that the marginal ray"),
        (plano_convex(), System(Aperture("entrance pupil", -8.0)), "gives no entrance pupil"),
        (plano_convex(), System(Aperture("object aperture", 0.1)), "gives no entrance pupil"),
        (plano_convex(), System(Aperture("image aperture", 1.5)), "gives no entrance pupil"),
        (plano_convex(), System(Aperture("object cone", 90.0), object_mm=100.0), "gives no entrance pupil"),
        # The object in the front focal plane has its image infinitely far.
        (
            plano_convex(),
            System(Aperture("working f-number", 4.0), object_mm=80 - 5 / N),
            "S2: expected a surface that",
        ),
        (plano_convex() * 101, System(Aperture("entrance pupil", 8.0)), "a lens of more than 300 rows"),
    ],
)
def test_what_cannot_be_computed_is_refused(rows: list[Row], system: System, problem: str) -> None:
    with pytest.raises(SpecError) as caught:
        semis(rows, system)
    assert problem in caught.value.message


def test_rays_beyond_the_edge_of_the_glass_do_not_count() -> None:
    """A biconvex lens of R 20 mm and 5 mm thickness ends at 9.68 mm, and its stop behind it would take more."""
    rows = [row("S1", 20, 5, N), row("S2", -20, 10), row("S3", None, 20, is_stop=True, semi_aperture_mm=8.5)]
    edge_mm = math.sqrt(20**2 - 17.5**2)
    front_mm, back_mm, _ = semis(rows, System(Aperture("stop")))
    assert 0.98 * edge_mm < front_mm <= edge_mm
    assert back_mm <= front_mm


def test_a_rim_that_the_file_gives_cuts_the_bundle() -> None:
    slope = math.tan(math.radians(12))
    rows = plano_convex()
    rows[1] = row("S2", None, 5, N, semi_aperture_mm=6.0)
    back_mm = semis(rows, System(Aperture("entrance pupil", 8.0), (FieldPoint("angle", 12.0),)))[2]
    assert back_mm == pytest.approx(height_behind(6.0, slope), rel=5e-3)


def test_vignetting_is_of_the_entrance_pupil_even_where_the_stop_turns_it_over() -> None:
    """The stop is 200 mm behind a lens of f = 100 mm, its image as far before it, upside down."""
    rows = [row("S1", None, 1, N), row("S2", -50, 200), row("S3", None, 50, is_stop=True)]
    slope = math.tan(math.radians(1))
    for low, high in ((-1.0, 0.5), (-0.5, 1.0)):
        system = System(Aperture("entrance pupil", 4.0), (FieldPoint("angle", 1.0, low, high),))
        assert semis(rows, system)[0] == pytest.approx(200 * slope + 2 * high, abs=0.15)


def test_heights_of_an_object_at_infinity_are_left_out_with_their_own_reason() -> None:
    points = (FieldPoint("object height", 3.0), FieldPoint("angle", 80.0))
    _, notes = with_semi_apertures(plano_convex(), System(Aperture("entrance pupil", 8.0), points), words="DIAM")
    assert notes[1:] == [
        "the field points at 80 degrees are left out, because none of their rays passes the lens",
        "the field points at 3 mm are left out, because a height of the object needs a near object, and that of the"
        " file is at infinity",
    ]
