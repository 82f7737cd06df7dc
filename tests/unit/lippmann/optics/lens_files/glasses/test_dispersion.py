"""The dispersion formulas of glass catalogues, against their equations written out once more."""

from __future__ import annotations

import math

import pytest

from lippmann.optics.lens_files.glasses.dispersion import FORMULA_NAMES, refractive_index

C = (1.1, 0.012, 0.013, 0.0009, 0.04, 0.0007, 0.02, 0.0003, 0.01, 0.0002)
"""Ten coefficients, no two alike, so that a change of their order shows."""


def expected(formula: int, w: float) -> float:
    """Return the index by the printed equation, w the wavelength in micrometres."""
    a, b, c, d, e, f, g, h, i, j = C
    series = {
        1: a + b * w**2 + c / w**2 + d / w**4 + e / w**6 + f / w**8,
        10: a + b * w**2 + c / w**2 + d / w**4 + e / w**6 + f / w**8 + g / w**10 + h / w**12,
        12: a + b * w**2 + c / w**2 + d / w**4 + e / w**6 + f / w**8 + g * w**4 + h * w**6,
        13: a + b * w**2 + c * w**4 + d / w**2 + e / w**4 + f / w**6 + g / w**8 + h / w**10 + i / w**12,
        2: 1 + a * w**2 / (w**2 - b) + c * w**2 / (w**2 - d) + e * w**2 / (w**2 - f),
        6: 1 + a * w**2 / (w**2 - b) + c * w**2 / (w**2 - d) + e * w**2 / (w**2 - f) + g * w**2 / (w**2 - h),
        11: 1 + a * w**2 / (w**2 - b) + c * w**2 / (w**2 - d) + e * w**2 / (w**2 - f) + g * w**2 / (w**2 - h)
        + i * w**2 / (w**2 - j),
        4: 1 + a + b * w**2 / (w**2 - c**2) + d / (w**2 - e**2),
        7: a + b / (w**2 - c) - d * w**2,
        8: a + b * w**2 / (w**2 - c) - d * w**2,
        9: a + b * w**2 / (w**2 - c) + d * w**2 / (w**2 - e),
    }  # fmt: skip
    if formula in series:
        return math.sqrt(series[formula])
    near = 1 / (w**2 - 0.028)
    direct: dict[int, float] = {
        3: a + b * near + c * near**2 + d * w**2 + e * w**4 + f * w**6,
        5: a + b / w + c / w**3.5,
    }
    return direct[formula]


@pytest.mark.parametrize("formula", FORMULA_NAMES)
@pytest.mark.parametrize("wavelength_um", [0.4861327, 0.5875618, 0.6562725])
def test_a_formula_is_its_equation(formula: int, wavelength_um: float) -> None:
    assert refractive_index(formula, C, wavelength_um) == pytest.approx(expected(formula, wavelength_um), rel=1e-12)


GLASSES = {
    "Sellmeier 1, N-BK7": (2, (1.03961212, 0.00600069867, 0.231792344, 0.0200179144, 1.01046945, 103.560653), 1.5168),
    "Sellmeier 1, SF6": (2, (1.72448482, 0.0134871947, 0.390104889, 0.0569318095, 1.04572858, 118.557185), 1.80518),
}


@pytest.mark.parametrize("name", GLASSES)
def test_a_data_sheets_coefficients_give_its_index(name: str) -> None:
    formula, coefficients, index = GLASSES[name]
    assert refractive_index(formula, coefficients, 0.5875618) == pytest.approx(index, abs=6e-6)


@pytest.mark.parametrize(
    ("formula", "coefficients"),
    [(1, (-1.0,)), (2, (1.0, 0.5875618**2)), (4, (1.0, 1.0, 1e200)), (5, (1e308, 1e308, 1e308)), (3, ())],
)
def test_where_there_is_no_index_the_result_is_no_number_or_no_glass(
    formula: int, coefficients: tuple[float, ...]
) -> None:
    found = refractive_index(formula, coefficients, 0.5875618)
    assert math.isnan(found) or found < 1 or found > 1e100
