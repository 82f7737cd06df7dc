"""The shape of a surface of a Zemax file: curvature, conic constant and the terms of an even asphere.

Zemax has a term of r^2 (PARM 1), and a prescription has none. The term becomes part of the curvature, c' = c + 2 a. A
conic constant k' with (1 + k') c'^3 = (1 + k) c^3 gives the same term of r^4, and the higher terms take the difference
of both conics,

    z = sum over i of C_i (1 + k)^(i - 1) c^(2i - 1) r^(2i), with 1 - sqrt(1 - x) = sum over i of C_i x^i.

The result is exact for a plane, and otherwise compared with the surface of the file out to its rim.
"""

from __future__ import annotations

import math

import numpy as np

from lippmann.optics.lens.asphere import Profile
from lippmann.optics.lens_files.zemax.lines import Block

MOST_TERMS = 8
"""The terms of a prescription, r^4 to r^18."""
MAX_CONIC = 1000.0
EXACT_MM = 1e-6
"""The greatest difference of two surfaces that count as the same."""
HEIGHTS = 257
"""The number of heights at which they are compared."""


def profile_of(block: Block, *, mm: float, is_even_asphere: bool, semi_mm: float) -> Profile:
    """Return the profile of a surface, in mm.

    Parameters
    ----------
    block
        The lines of the surface.
    mm
        The length of the file's unit, mm.
    is_even_asphere
        True if the terms of PARM count.
    semi_mm
        The semi-diameter; 0 if it is unknown.

    Raises
    ------
    SpecError
        If the surface has terms that cannot be modelled.
    """
    curvature_per_mm, conic = block.number("CURV") / mm, block.number("CONI")
    if not is_even_asphere:
        return Profile(curvature_per_mm, conic, ())
    square, terms = _terms(block, mm)
    given = Profile(curvature_per_mm, conic, terms)
    if square == 0.0:
        return given
    made = without_square_term(given, square)
    is_plane = curvature_per_mm == 0.0
    if made is None or abs(made.conic) > MAX_CONIC or not (is_plane or _is_same(given, square, made, semi_mm)):
        line = next(line for line in block.lines if line.word == "PARM" and line.value(0) == 1)
        line.refuse("a term of r^2 that curvature, conic constant and terms to r^18 can take within the semi-diameter")
    return made


def _is_same(given: Profile, square: float, made: Profile, semi_mm: float) -> bool:
    heights_mm2 = np.linspace(0.0, semi_mm, HEIGHTS) ** 2
    with np.errstate(all="ignore"):
        off_mm = given.sag_mm(heights_mm2) + square * heights_mm2 - made.sag_mm(heights_mm2)
        return semi_mm > 0 and bool((np.abs(off_mm) < EXACT_MM).all())


def without_square_term(profile: Profile, square: float) -> Profile | None:
    """Return a profile that includes a term of r^2; None beyond the range of floating-point numbers.

    Parameters
    ----------
    profile
        The profile without the term.
    square
        The coefficient of r^2, in 1 / mm.
    """
    old, new = profile.curvature_per_mm, profile.curvature_per_mm + 2.0 * square
    try:
        old_root = 1.0 + profile.conic
        new_root = old_root * old**3 / new**3 if new != 0.0 else 0.0  # This is 1 + k'.
        terms = [*profile.aspheric, *([0.0] * MOST_TERMS)][:MOST_TERMS]
        for place, order in enumerate(range(2, MOST_TERMS + 2)):
            power = 2 * order - 1
            conics = old_root ** (order - 1) * old**power - new_root ** (order - 1) * new**power
            terms[place] += _root_coefficient(order) * conics
    except (OverflowError, ZeroDivisionError):
        return None
    if old == 0.0:
        terms = list(profile.aspheric)  # The paraboloid of the new curvature is the term.
    return Profile(new, new_root - 1.0, tuple(terms))


def _root_coefficient(order: int) -> float:
    """Return the coefficient of x^order in 1 - sqrt(1 - x): 1/2, 1/8, 1/16, 5/128, ..."""
    return math.comb(2 * order, order) / (4.0**order * (2 * order - 1))


def _terms(block: Block, mm: float) -> tuple[float, tuple[float, ...]]:
    """Return the coefficient of r^2, and those of r^4, r^6, ..., in mm; PARM n is that of r^(2n)."""
    terms = [0.0] * MOST_TERMS
    for line in block.lines:
        if line.word != "PARM" or line.value(1) == 0.0:
            continue
        order = int(line.value(0))
        if not 1 <= order <= MOST_TERMS:
            line.refuse("terms of r^2 to r^16, PARM 1 to 8")
        terms[order - 1] = line.value(1) / mm ** (2 * order - 1)
    square, *higher = terms
    while higher and higher[-1] == 0.0:
        higher.pop()
    return square, tuple(higher)
