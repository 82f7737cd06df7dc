"""Rims of neighbouring surfaces that would cross."""

from __future__ import annotations

import math
from typing import Any

import pytest

from lippmann.errors import OpticsError
from lippmann.optics.lens_files.lens_file import LensFile, check_lens_file
from lippmann.optics.lens_files.rows import Row, prescription_of_rows

BICONVEX_EDGE_MM = math.sqrt(50**2 - 48**2)
"""The height at which two spheres of R 50 mm, 4 mm apart, touch."""


def lens(*surfaces: tuple[float, float, float, float, bool]) -> LensFile:
    rows = []
    for number, (radius_mm, thickness_mm, index, semi_mm, may_shrink) in enumerate(surfaces, start=1):
        fields: dict[str, Any] = {"radius_mm": radius_mm, "thickness_mm": thickness_mm, "index": index}
        rows.append(Row(f"line {number}, S{number}", {**fields, "semi_aperture_mm": semi_mm}, may_shrink=may_shrink))
    return prescription_of_rows(rows)


def test_glass_ends_where_its_faces_touch() -> None:
    file = lens((50, 4, 1.5, 14.5, True), (-50, 90, 1, 15, True))
    for surface in file.prescription.surfaces:
        assert surface.semi_aperture_mm == pytest.approx(BICONVEX_EDGE_MM, abs=0.02)
        assert surface.semi_aperture_mm <= BICONVEX_EDGE_MM
    cross = "mm, where this surface and its neighbour would cross"
    assert file.notes == (
        f"line 1, S1: the semi-diameter is reduced from 14.5 to 13.989 {cross}",
        f"line 2, S2: the semi-diameter is reduced from 15 to 13.989 {cross}",
    )
    check_lens_file(file)


def test_in_air_the_narrower_rim_is_enough() -> None:
    file = lens((-300, 3, 1.5, 16, True), (50, 4, 1, 15, True), (-50, 3, 1.6, 15.5, True), (-300, 50, 1, 15.5, True))
    semis_mm = [surface.semi_aperture_mm for surface in file.prescription.surfaces]
    assert semis_mm == pytest.approx([16, BICONVEX_EDGE_MM, 15.5, 15.5], abs=0.02)
    assert len(file.notes) == 1


@pytest.mark.parametrize(
    "surfaces",
    [
        [(50, 4, 1.5, 14.5, True), (-50, 90, 1, 15, False)],
        [(50, 4, 1.5, 14.5, False), (-50, 90, 1, 15, False)],
        [(50, 1, 1.5, 15, True), (-50, 90, 1, 15, True)],
    ],
)
def test_rims_of_a_user_and_those_of_half_a_lens_stay_and_are_refused(
    surfaces: list[tuple[float, float, float, float, bool]],
) -> None:
    file = lens(*surfaces)
    assert file.notes == ()
    assert [one.semi_aperture_mm for one in file.prescription.surfaces] == [one[3] for one in surfaces]
    with pytest.raises(
        OpticsError, match=r"^line 1, S1, thickness_mm: expected at least .* mm, or rims within .* mm, w"
    ):
        check_lens_file(file)


def test_rims_that_do_not_cross_stay() -> None:
    assert lens((50, 4, 1.5, 13.9, True), (-50, 90, 1, 13.9, True)).notes == ()
