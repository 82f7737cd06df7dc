"""Lenses over a picture from elsewhere: what is refused comes with advice that holds."""

from __future__ import annotations

import re

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lippmann.errors import LayoutError
from lippmann.job.scenes.imported_sheets import SheetGeometry
from lippmann.lattice.cell import Lattice
from lippmann.lattice.layout import CellLayout, check_size
from lippmann.plan.imported import lens_grid

SIZE = (64, 72)

ADVICE = re.compile(
    r"has room for (?P<cols>\d+) x (?P<rows>\d+)(, or as many with a pitch of (?P<pitch>[\d.]+) px)?"
    r"(?P<middle>, or as many in the middle of the picture, without an offset)?$"
)


def test_the_advice_knows_of_the_offset() -> None:
    # 8 x 9 lenses of 8 px fit in the middle, and 7 x 8 of them from a first lens that stands 9 px further in.
    asked = {"pitch_px": 8.0, "count": (8, 9), "offset_px": (13.0, 13.0)}
    with pytest.raises(LayoutError) as refused:
        lens_grid(SheetGeometry.model_validate(asked), SIZE)
    assert refused.value.message.endswith(
        "; from this first lens it has room for 7 x 6, or as many with a pitch of 6.80 px,"
        " or as many in the middle of the picture, without an offset"
    )


@settings(deadline=None, max_examples=150)
@given(
    pitch_px=st.floats(2.5, 30),
    lattice=st.sampled_from(["square", "hexagonal"]),
    count=st.tuples(st.integers(1, 30), st.integers(1, 30)),
    rotation_deg=st.floats(-10, 10),
    row_pitch=st.none() | st.floats(0.8, 1.2),
    offset=st.none() | st.tuples(st.floats(0.05, 0.5), st.floats(0.05, 0.5)),
)
def test_all_advice_is_accepted_when_it_is_taken(
    pitch_px: float, lattice: str, count: tuple[int, int], rotation_deg: float, row_pitch: float | None,
    offset: tuple[float, float] | None,
) -> None:  # fmt: skip
    asked = {"pitch_px": pitch_px, "lattice": lattice, "count": count, "rotation_deg": rotation_deg}
    if row_pitch is not None:
        asked["row_pitch_px"] = max(2.0, row_pitch * pitch_px)
    if offset is not None:
        asked["offset_px"] = (offset[0] * SIZE[0], offset[1] * SIZE[1])
    try:
        lens_grid(SheetGeometry.model_validate(asked), SIZE)
        return
    except LayoutError as error:
        message = error.message
    advice = ADVICE.search(message)
    if advice is None:
        assert re.search(r"expected (the first lens, of .* px, whole|a whole lens of .* px) on 72 x 64 px", message)
        return
    counts = (int(advice["rows"]), int(advice["cols"]))
    assert counts != count, "what was asked for is not suggested"
    lens_grid(SheetGeometry.model_validate(asked | {"count": counts}), SIZE)
    if advice["pitch"]:
        lens_grid(SheetGeometry.model_validate(asked | {"pitch_px": float(advice["pitch"])}), SIZE)
    if advice["middle"]:
        lens_grid(SheetGeometry.model_validate({key: asked[key] for key in asked if key != "offset_px"}), SIZE)


@settings(deadline=None, max_examples=150)
@given(
    lattice=st.sampled_from(["square", "hexagonal"]),
    count=st.tuples(st.integers(1, 300), st.integers(1, 300)),
    half_px=st.integers(1, 20),
    scale=st.floats(0.5, 2),
    stretch=st.floats(0.994, 1.006),
)
def test_the_pitch_that_a_sheet_of_another_size_is_said_to_have_is_accepted(
    lattice: Lattice, count: tuple[int, int], half_px: int, scale: float, stretch: float
) -> None:
    layout = CellLayout(*count, 2 * half_px, lattice)
    size = (round(layout.rows * scale * stretch), round(layout.cols * scale))
    try:
        check_size(*size, layout)
        return
    except LayoutError as error:
        advice = re.search(r"a pitch of ([\d.]+) px(?: and a row pitch of ([\d.]+) px)? fits", error.message)
    if advice is None or float(advice[1]) < 2:
        return
    asked = {"pitch_px": float(advice[1]), "count": count, "lattice": lattice}
    if advice[2] is not None:
        if float(advice[2]) < 2:
            return
        asked["row_pitch_px"] = float(advice[2])
    lens_grid(SheetGeometry.model_validate(asked), size)
