"""The calibration sheet under a simulated array: one pixel a lens."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from lippmann.job.optics.rig import Rig
from lippmann.job.outputs.prints import CalibrationSheet
from lippmann.plan.printing.calibration_sheet import CalibrationPage, Direction, Strip, calibration_page, moire_mm
from lippmann.plan.printing.shapes import Bar, TextLine
from worker.images.drawing import paper

PIXEL_MM = 25.4 / 600


@lru_cache(maxsize=8)
def page_of(direction: Direction, *, lattice: str = "square", **options: Any) -> CalibrationPage:
    rig = Rig.model_validate({"lens_array": {"lattice": lattice}})
    return calibration_page(CalibrationSheet(dpi=600, **{"strip_mm": 1, **options}), rig, direction)


def ink_along(page: CalibrationPage, strip: Strip) -> NDArray[np.float32]:
    """Return the printed pixels of a line through the middle of a strip, 1 is ink, from the strip's beginning."""
    first, stop = round(strip.top_mm / PIXEL_MM), round((strip.top_mm + strip.height_mm) / PIXEL_MM)
    left, right = round(strip.left_mm / PIXEL_MM), round((strip.left_mm + strip.width_mm) / PIXEL_MM)
    if page.direction == "across":
        return printed(page)[(first + stop) // 2, left:right]
    return printed(page)[first:stop, (left + right) // 2]


@lru_cache(maxsize=1)
def printed(page: CalibrationPage) -> NDArray[np.float32]:
    return 1 - paper(page.shapes, pixel_mm=page.pixel_mm, top=0, rows=page.rows, cols=page.cols)


def evenness(ink: NDArray[np.float32], apart_mm: float) -> float:
    """Return how even lenses this far apart make a strip: the share of them that see the same, over eyes all round."""
    shares = []
    for eye in np.arange(24) / 24:
        places_mm = (eye + np.arange(int(len(ink) * PIXEL_MM / apart_mm) - 1)) * apart_mm
        seen = ink[(places_mm / PIXEL_MM).astype(int)]
        shares.append(max(seen.mean(), 1 - seen.mean()))
    return float(np.mean(shares))


@pytest.mark.parametrize("direction", ["across", "down"])
@pytest.mark.parametrize("change_percent", [-0.7, 0.0, 0.4])
def test_the_strip_of_the_true_pitch_is_the_even_one(direction: Direction, change_percent: float) -> None:
    page = page_of(direction)
    seen = [evenness(ink_along(page, strip), 1 + change_percent / 100) for strip in page.strips]
    best = int(np.argmax(seen))
    assert page.strips[best].change_percent == pytest.approx(change_percent, abs=1e-9)
    # Lines begin and end within half a pixel, so eyes at their edges see some of both; a step off, bands are seen.
    assert seen[best] > 0.95
    assert all(share < 0.93 for number, share in enumerate(seen) if number != best)


@pytest.mark.parametrize(("direction", "apart"), [("across", 1.0), ("down", math.sqrt(3) / 2)])
def test_under_hexagons_both_kinds_of_lens_rows_see_the_same_lines(direction: Direction, apart: float) -> None:
    page = page_of(direction, lattice="hexagonal")
    seen = [evenness(ink_along(page, strip), apart * 0.997) for strip in page.strips]
    assert page.strips[int(np.argmax(seen))].change_percent == pytest.approx(-0.3, abs=1e-9)
    if direction == "across":
        # A lens row half a pitch further right lies on the same part of a line.
        (even,) = (strip for strip in page.strips if strip.change_percent == 0)
        ink = ink_along(page, even)
        at = ((np.arange(100) + 0.25 / 2) / PIXEL_MM).astype(int)
        half = ((np.arange(100) + 0.5 + 0.25 / 2) / PIXEL_MM).astype(int)
        assert (ink[at] == 1).all()
        assert (ink[half] == 1).all()


def test_an_eye_at_a_distance_finds_a_wider_strip_even() -> None:
    page = page_of("across")
    gap_mm, distance_mm = 3.3, 660.0
    seen = [evenness(ink_along(page, strip), 1.0 * (1 + gap_mm / distance_mm)) for strip in page.strips]
    assert page.strips[int(np.argmax(seen))].change_percent == pytest.approx(100 * gap_mm / distance_mm)


@pytest.mark.parametrize("change_percent", [-1.0, 0.8, 1.0])
def test_bands_are_as_wide_as_the_formula_says(change_percent: float) -> None:
    page = page_of("across", length_mm=400)
    (strip,) = (strip for strip in page.strips if strip.change_percent == pytest.approx(change_percent))
    ink = ink_along(page, strip)
    seen = ink[((np.arange(395) + 0.3) / PIXEL_MM).astype(int)]
    # The frequency at which the lenses' light swings most.
    lens, cycles = np.arange(395), np.linspace(1 / 300, 1 / 50, 1000)
    swing = np.abs(np.exp(-2j * np.pi * np.outer(cycles, lens)) @ (seen - seen.mean()))
    assert 1 / cycles[swing.argmax()] == pytest.approx(moire_mm(1.0, strip.pitch_mm), rel=0.02)


@pytest.mark.parametrize("direction", ["across", "down"])
def test_lines_are_whole_pixels_and_everything_is_on_the_page(direction: Direction) -> None:
    page = page_of(direction, steps=5, length_mm=40)
    bars = [shape for shape in page.shapes if isinstance(shape, Bar)]
    for bar in bars:
        sides = np.array([bar.left_mm, bar.top_mm, bar.right_mm, bar.bottom_mm]) / PIXEL_MM
        np.testing.assert_allclose(sides, np.round(sides), atol=1e-6)
        assert (sides >= 0).all()
        assert sides[2] <= page.cols
        assert sides[3] <= page.rows
    assert len(bars) == sum(math.floor(40 / strip.pitch_mm) for strip in page.strips)
    words = [shape.text for shape in page.shapes if isinstance(shape, TextLine)]
    assert "Calibration sheet" in words[0]
    assert {"0.99", "1"} <= {text.removesuffix(" mm") for text in words}
    assert {"-1 %", "0 %", "+0.5 %"} <= set(words)
