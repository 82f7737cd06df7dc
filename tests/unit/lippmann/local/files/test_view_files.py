"""Views by the names of their files."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import numpy as np
import pytest

from lippmann.errors import BadInput
from lippmann.local.files.view_files import quilt_name, view_files


@pytest.mark.parametrize(
    "name",
    [
        "out_{v:02d}_{u:02d}_-780_1103_.png",
        "Sub-aperture_{v:02d}_{u:02d}.png",
        "scene ({v}, {u}).png",
        "frame_0007_{v}_{u}.png",
        "{v}_{u}_0007.png",
        "lf-{v}-{u}.png",
        "View_v={v}_u={u}.png",
        "row{v:02d}col{u:02d}.png",
        "x{u}y{v}_z1.5.png",
        "{u}_{v}.png",
        "view{v:02d}_{u:02d}.png",
        "cam{v}_{u}_-381.9_776.3_.png",
        "v2_x{u}_y{v}.png",
        "bunny_v1_c2_{v:02d}_{u:02d}.png",
    ],
)
def test_rows_and_columns_in_names_are_told_apart(tmp_path: Path, name: str) -> None:
    for v, u in np.ndindex(2, 3):
        (tmp_path / name.format(v=v + 4, u=u + 1)).touch()
    found = view_files(tmp_path, "grid")
    assert (found.rows, found.cols) == (2, 3)
    assert [found.files[place].name for place in np.ndindex(2, 3)] == [
        name.format(v=v + 4, u=u + 1) for v, u in np.ndindex(2, 3)
    ]


@pytest.mark.parametrize("parallax", ["row", "grid"])
@pytest.mark.parametrize(
    ("name", "other"),
    [
        ("out_{v:02d}_{u:02d}.png", "sheet_r3_c4.png"),
        ("r{v}_c{u}.png", "sheet_3_4.png"),
        ("IMG_0001_{v}_{u}.png", "sheet_3_4.png"),
    ],
)
def test_one_picture_of_another_name_places_no_view(
    tmp_path: Path, name: str, other: str, parallax: Literal["row", "grid"]
) -> None:
    for v, u in np.ndindex(3, 4):
        (tmp_path / name.format(v=v, u=u)).touch()
    (tmp_path / other).touch()
    found = view_files(tmp_path, parallax)
    assert (found.rows, found.cols) == (3, 4)
    assert (found.note is None) == name.startswith("r")


def test_a_picture_in_the_place_of_a_view_is_refused(tmp_path: Path) -> None:
    for v, u in np.ndindex(3, 4):
        (tmp_path / f"out_{v:02d}_{u:02d}.png").touch()
    (tmp_path / "a_1_2_3_4.png").touch()
    with pytest.raises(
        BadInput, match=r"expected one view of row 1 and column 2, got .*a_1_2_3_4\.png and .*out_01_02"
    ):
        view_files(tmp_path, "grid")


def test_a_number_that_all_names_end_with_leaves_a_row_of_views(tmp_path: Path) -> None:
    for number in (1, 2, 10):
        (tmp_path / f"cam{number}_2048.png").touch()
    found = view_files(tmp_path, "row")
    assert (found.rows, [found.files[0, col].stem for col in range(found.cols)], found.note) == (
        1, ["cam1_2048", "cam2_2048", "cam10_2048"], None,
    )  # fmt: skip


def test_a_missing_view_is_named_though_another_picture_has_letters(tmp_path: Path) -> None:
    for v, u in list(np.ndindex(3, 4))[:-1]:
        (tmp_path / f"out_{v}_{u}.png").touch()
    (tmp_path / "sheet_r3_c4.png").touch()
    with pytest.raises(BadInput, match=r"expected 4 x 3 views .*, got 11: 1 are missing"):
        view_files(tmp_path, "grid")


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("a_qs8x6a0.75.png", (8, 6, 0.75)),
        ("a_QS05x09A1.png", (5, 9, 1.0)),
        ("a_qs8x6a.5 (1).png", (8, 6, 0.5)),
        ("qs8x6.png", (8, 6, None)),
        ("a_qs8x6a1.777778_v2.png", (8, 6, 1.777778)),
    ],
)
def test_names_of_quilts_as_other_programs_write_them(name: str, expected: tuple[int, int, float | None]) -> None:
    found = quilt_name(Path(name))
    assert (found.columns, found.rows, found.aspect) == expected


def test_views_of_other_names_are_a_row_in_the_order_of_their_numbers(tmp_path: Path) -> None:
    for number in range(1, 13):
        (tmp_path / f"view{number}.png").touch()
    found = view_files(tmp_path, "row")
    assert [found.files[0, col].stem for col in range(12)] == [f"view{number}" for number in range(1, 13)]
