"""Even aspheres of Zemax files, with their terms of r^2."""

from __future__ import annotations

import math

import numpy as np
import pytest

from lippmann.errors import SpecError
from lippmann.optics.lens.asphere import Profile
from lippmann.optics.lens_files.zemax.aspheres import profile_of, without_square_term
from lippmann.optics.lens_files.zemax.lines import read_blocks


def profile(lines: str, *, mm: float = 1.0, semi_mm: float = 13.0) -> Profile:
    _, (block,) = read_blocks("SURF 1\n" + lines.replace("; ", "\n"))
    return profile_of(block, mm=mm, is_even_asphere=True, semi_mm=semi_mm)


def sag(radius_mm: float, conic: float, terms: dict[int, float], heights_mm: np.ndarray) -> np.ndarray:
    """Return the sag by the formula of the manual, with any even powers."""
    c, square = 1 / radius_mm, heights_mm**2
    conics = c * square / (1 + np.sqrt(1 - (1 + conic) * c**2 * square))
    powers: np.ndarray = sum(term * heights_mm**power for power, term in terms.items()) + conics
    return powers


@pytest.mark.parametrize(
    ("radius_mm", "conic", "square"),
    [(13.8, -0.9, 8e-6), (-40.0, 0.0, -3e-5), (60.0, 1.5, 2e-4), (25.0, -1.0, 1e-3), (200.0, -3.0, -2.5e-3)],
)
def test_a_term_of_r2_becomes_curvature_and_higher_terms(radius_mm: float, conic: float, square: float) -> None:
    found = profile(f"CURV {1 / radius_mm!r}; CONI {conic}; PARM 1 {square}; PARM 2 5e-6; PARM 4 1e-12")
    assert found.curvature_per_mm == pytest.approx(1 / radius_mm + 2 * square)
    heights_mm = np.linspace(0, 13, 50)
    expected = sag(radius_mm, conic, {2: square, 4: 5e-6, 8: 1e-12}, heights_mm)
    assert found.sag_mm(heights_mm**2) == pytest.approx(expected, abs=1e-6)


def test_a_plane_with_a_term_of_r2_is_a_paraboloid() -> None:
    assert profile("CURV 0; PARM 1 0.01; PARM 2 1e-5", semi_mm=0.0) == Profile(0.02, -1.0, (1e-5,))


def test_a_term_of_r2_has_the_unit_of_the_file() -> None:
    in_cm = profile("CURV 0.25; CONI -0.5; PARM 1 1e-3; PARM 2 1e-4", mm=10.0)
    in_mm = profile("CURV 0.025; CONI -0.5; PARM 1 1e-4; PARM 2 1e-7")
    heights_mm2 = np.linspace(0, 13, 50) ** 2
    assert in_cm.sag_mm(heights_mm2) == pytest.approx(in_mm.sag_mm(heights_mm2), abs=1e-12)


@pytest.mark.parametrize(
    ("lines", "semi_mm"),
    [
        ("CURV 0.07; PARM 1 0.02", 13.0),
        ("CURV 0.02; PARM 1 1e-5", 0.0),
        ("CURV 0.02; PARM 1 -0.00999", 5.0),
        ("CURV 1e200; PARM 1 1e-5", 5.0),
        ("CURV 1e-200; PARM 1 -1e-200", 5.0),
        ("CURV 0.1; PARM 1 1e-5", 11.0),
    ],
)
def test_a_term_of_r2_that_the_others_cannot_take_is_refused(lines: str, semi_mm: float) -> None:
    with pytest.raises(SpecError, match=r"^line 3, PARM: expected a term of r\^2 that curvature, conic constant and"):
        profile(lines, semi_mm=semi_mm)


def test_the_result_has_no_limits_of_its_own() -> None:
    cancelled = without_square_term(Profile(0.02, 0.0), -0.01)
    assert cancelled is not None
    assert (cancelled.curvature_per_mm, cancelled.conic) == (0.0, -1.0)
    # 1 - sqrt(1 - x) = x / 2 + x^2 / 8 + x^3 / 16 + ...
    assert cancelled.aspheric[:2] == pytest.approx((0.02**3 / 8, 0.02**5 / 16))
    assert all(map(math.isfinite, cancelled.aspheric))
