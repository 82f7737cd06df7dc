"""The dispersion formulas of glass catalogues: the refractive index at a wavelength in micrometres.

The numbers and the order of the coefficients are those of the AGF format (OpticStudio User Guide, "The Glass Dispersion
Formulas"). Coefficients that are absent are 0. The index is relative to air at the temperature of the catalogue.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType

MOST_COEFFICIENTS = 12
"""The coefficients that a formula may have; the longest uses 10."""

Formula = Callable[[Sequence[float], float], float]


def refractive_index(formula: int, coefficients: Sequence[float], wavelength_um: float) -> float:
    """Return the refractive index by a formula of the AGF format; NaN where the formula gives no real index.

    Parameters
    ----------
    formula
        The number of the formula in the format, 1 to 13.
    coefficients
        The coefficients, at most `MOST_COEFFICIENTS`.
    wavelength_um
        The wavelength, micrometres.

    Examples
    --------
    >>> bk7 = (1.03961212, 6.00069867e-3, 0.231792344, 2.00179144e-2, 1.01046945, 103.560653)
    >>> round(refractive_index(2, bk7, 0.5875618), 6)
    1.5168
    """
    filled = (*coefficients, *([0.0] * MOST_COEFFICIENTS))[:MOST_COEFFICIENTS]
    try:
        index = _FORMULAS[formula](filled, wavelength_um * wavelength_um)
    except (ZeroDivisionError, OverflowError):
        return math.nan
    return index if math.isfinite(index) else math.nan


def _root(square: float) -> float:
    return math.sqrt(square) if square >= 0 else math.nan


def _power_series(powers: Sequence[int]) -> Formula:
    """Return n^2 as the sum of c_i w^(p_i), w the square of the wavelength."""

    def formula(c: Sequence[float], w: float) -> float:
        return _root(sum(one * w**power for one, power in zip(c, powers, strict=False)))

    return formula


def _sellmeier(terms: int) -> Formula:
    """Return n^2 as 1 + the sum of K_i w / (w - L_i)."""

    def formula(c: Sequence[float], w: float) -> float:
        return _root(1.0 + sum(c[2 * place] * w / (w - c[2 * place + 1]) for place in range(terms)))

    return formula


def _sellmeier_2(c: Sequence[float], w: float) -> float:
    return _root(1.0 + c[0] + c[1] * w / (w - c[2] ** 2) + c[3] / (w - c[4] ** 2))


def _sellmeier_4(c: Sequence[float], w: float) -> float:
    return _root(c[0] + c[1] * w / (w - c[2]) + c[3] * w / (w - c[4]))


def _herzberger(c: Sequence[float], w: float) -> float:
    near = 1.0 / (w - 0.028)
    return c[0] + c[1] * near + c[2] * near**2 + c[3] * w + c[4] * w**2 + c[5] * w**3


def _conrady(c: Sequence[float], w: float) -> float:
    wavelength = math.sqrt(w)
    return c[0] + c[1] / wavelength + c[2] / math.pow(wavelength, 3.5)


def _handbook_1(c: Sequence[float], w: float) -> float:
    return _root(c[0] + c[1] / (w - c[2]) - c[3] * w)


def _handbook_2(c: Sequence[float], w: float) -> float:
    return _root(c[0] + c[1] * w / (w - c[2]) - c[3] * w)


FORMULA_NAMES = MappingProxyType(
    {
        1: "Schott",
        2: "Sellmeier 1",
        3: "Herzberger",
        4: "Sellmeier 2",
        5: "Conrady",
        6: "Sellmeier 3",
        7: "Handbook of Optics 1",
        8: "Handbook of Optics 2",
        9: "Sellmeier 4",
        10: "Extended",
        11: "Sellmeier 5",
        12: "Extended 2",
        13: "Extended 3",
    }
)
"""The formulas by their numbers in the format."""

_FORMULAS: Mapping[int, Formula] = MappingProxyType(
    {
        1: _power_series((0, 1, -1, -2, -3, -4)),
        2: _sellmeier(3),
        3: _herzberger,
        4: _sellmeier_2,
        5: _conrady,
        6: _sellmeier(4),
        7: _handbook_1,
        8: _handbook_2,
        9: _sellmeier_4,
        10: _power_series((0, 1, -1, -2, -3, -4, -5, -6)),
        11: _sellmeier(5),
        12: _power_series((0, 1, -1, -2, -3, -4, 2, 3)),
        13: _power_series((0, 1, 2, -1, -2, -3, -4, -5, -6)),
    }
)
