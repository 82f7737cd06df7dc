"""The views of a light field in files of other programs: a quilt, or a folder with a file for every view.

=========================== ============================================================================
names                       views
=========================== ============================================================================
`..._qs8x6a0.75.png`        a quilt of 8 columns and 6 rows of tiles, the first tile at the lower left; `_qs8x6` names
                            no aspect
`input_Cam000.png`          row by row from the upper left (HCI benchmark); `parameters.cfg` may tell their number
`003_012.ppm`               column and row (JPEG Pleno, and the output `subaperture_ppm`)
`out_03_12_-381.9_.png`     row and column (Stanford archive), whatever follows or precedes, as in `IMG_0001_03_12.png`
`view_r03_c12.png`          row and column by these letters, or v and u, y and x, or in full
any other                   with parallax along a row: in the order of the numbers in the names
=========================== ============================================================================
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from configparser import ConfigParser, Error
from dataclasses import dataclass, replace
from itertools import pairwise, product
from pathlib import Path
from typing import Literal

from lippmann.errors import BadInput
from lippmann.job.scenes.imported_sheets import SUFFIXES

Parallax = Literal["row", "grid"]
"""`row` if views differ along one row, as in most quilts, `grid` if along rows and columns."""

NameOrder = Literal["column_row", "row_column"]
"""The meaning of the two numbers in the names of views."""

_Named = list[tuple[Path, tuple[int, int]]]
"""Pictures with the (row, column) that their names give."""

VIEWS_AT_MOST = 65_536
"""The largest number of files of a folder that are taken for views."""

_QUILT = re.compile(r"(?<![a-z])qs(\d{1,3})x(\d{1,3})(?:a(\d{0,3}(?:\.\d{1,9})?))?(?![\da-z])", re.IGNORECASE)
_HCI = re.compile(r"input_Cam(\d{1,6})")
_NUMBERS = re.compile(r"\d{1,9}")
_TWO_NUMBERS = re.compile(r"(\d{1,5})_(\d{1,5})")
_BETWEEN = re.compile(r"[-_ ,()]+")
_FIRST_NUMBER, _SECOND_NUMBER = re.compile(r"(?:.*[^\d.])?(\d{1,5})"), re.compile(r"(\d{1,5})")
"""Two neighbouring words that place a view; a name may stand before the first number, as in `view00_00`."""
_LETTERED = tuple(
    re.compile(rf"(?<![a-z])(?:{words})[-_= ]?(\d{{1,5}})(?!\d|\.\d)", re.IGNORECASE)
    for words in ("row|r|v|y", "column|col|c|u|x")
)
"""The row and the column of a view behind a letter or a word."""
_LETTERS_AT_MOST = 4
"""The number of rows, and of columns, in a name that are tried, since a v may name a version."""
_CAMERAS_FILE, _CAMERAS_BYTES = "parameters.cfg", 1 << 16


@dataclass(frozen=True)
class QuiltName:
    """The columns, rows and aspect in the name of a quilt."""

    columns: int
    rows: int
    aspect: float | None
    """Width by height of a view; None if the name has none."""


@dataclass(frozen=True)
class ViewFiles:
    """The files of views by their places."""

    rows: int
    cols: int
    files: Mapping[tuple[int, int], Path]
    """The files by (row, column) of the view: down and to the right as the eye moves."""
    note: str | None = None
    """A note if the names could be understood in another way."""


def quilt_name(path: Path) -> QuiltName:
    """Return what the name of a quilt says.

    Raises
    ------
    BadInput
        If it does not name columns, rows and aspect.

    Examples
    --------
    >>> quilt_name(Path("0001_qs8x6a0.75.png"))
    QuiltName(columns=8, rows=6, aspect=0.75)
    """
    found = _QUILT.search(path.name)
    columns, rows = (int(found[1]), int(found[2])) if found else (0, 0)
    aspect = float(found[3]) if found and found[3] else None
    if not (columns and rows) or aspect == 0:
        raise BadInput(
            "expected a folder of views, or a quilt whose name ends like _qs8x6a0.75 (columns, rows, aspect), got"
            f" {path}"
        )
    return QuiltName(columns, rows, aspect)


def view_files(folder: Path, parallax: Parallax, *, order: NameOrder | None = None) -> ViewFiles:
    """Return the files of the views in a folder.

    Parameters
    ----------
    folder
        The folder; files that are no pictures, and pictures that are no views, are left out.
    parallax
        `grid` for rows and columns of views, `row` for one row from the leftmost to the rightmost.
    order
        What the two numbers in the names are; by default `column_row`, and `row_column` after other words.

    Raises
    ------
    BadInput
        If there are no views, or some are missing.
    """
    pictures = sorted(path for path in folder.iterdir() if path.suffix.lower() in SUFFIXES and path.is_file())
    if len(pictures) > VIEWS_AT_MOST:
        raise BadInput(f"expected at most {VIEWS_AT_MOST} views in {folder}, got {len(pictures)} pictures")
    numbered = {int(found[1]): path for path in pictures if (found := _HCI.fullmatch(path.stem))}
    if numbered:
        return _hci(folder, numbered, parallax)
    lettered, numbered_pairs = _by_letters(pictures), _by_two_numbers(pictures, order)
    named = max((*lettered, *numbered_pairs), key=_weight, default=None)
    is_told = order is not None or named in lettered
    if named and (is_told or parallax == "grid" or len({col for _, (_, col) in named}) > 1):
        note = None if is_told else _order_note(named[0][0])
        return replace(_whole(folder, _placed(named)), note=note)
    if parallax == "row" and pictures:
        in_order = sorted(pictures, key=_by_numbers)
        return ViewFiles(1, len(pictures), {(0, place): path for place, path in enumerate(in_order)})
    raise BadInput(
        f"expected views in {folder} named as input_Cam000.png, 000_000.ppm, out_00_00.png or r00_c00.png, got"
        f" {pictures[0].name if pictures else 'no picture'}"
    )


def _by_numbers(path: Path) -> tuple[list[int], str]:
    """Return what sorts view2.png before view10.png."""
    return [int(number) for number in _NUMBERS.findall(path.stem)], path.name


def _hci(folder: Path, numbered: Mapping[int, Path], parallax: Parallax) -> ViewFiles:
    count = max(numbered) + 1
    rows, cols = (1, count) if parallax == "row" else _cameras(folder / _CAMERAS_FILE) or (math.isqrt(count),) * 2
    if rows * cols != count:
        raise BadInput(
            f"expected as many rows of views as columns in {folder}, or their number as num_cams_x and num_cams_y in"
            f" {_CAMERAS_FILE}, got {count} views"
        )
    return _whole(folder, {divmod(number, cols): path for number, path in numbered.items()})


def _cameras(path: Path) -> tuple[int, int] | None:
    """Return the (rows, columns) of cameras that an HCI folder tells; None if it does not."""
    parser = ConfigParser(interpolation=None)
    try:
        with path.open("rb") as file:
            parser.read_string(file.read(_CAMERAS_BYTES).decode("utf-8", "replace"))
        rows, cols = (int(parser["extrinsics"][f"num_cams_{axis}"]) for axis in "yx")
    except (OSError, Error, KeyError, ValueError):
        return None
    return (rows, cols) if min(rows, cols) > 0 else None


def _by_letters(pictures: list[Path]) -> list[_Named]:
    """Return the views by every row and column that their names give behind letters."""
    found = [[[int(one[1]) for one in axis.finditer(path.stem)] for axis in _LETTERED] for path in pictures]
    named: list[_Named] = []
    for of_row, of_col in product(range(_LETTERS_AT_MOST), repeat=2):
        with_both = zip(pictures, found, strict=True)
        named.append(
            [
                (path, (rows[of_row], cols[of_col]))
                for path, (rows, cols) in with_both
                if of_row < len(rows) and of_col < len(cols)
            ]
        )
    return [one for one in named if one]


def _by_two_numbers(pictures: list[Path], order: NameOrder | None) -> list[_Named]:
    """Return the views by every two neighbouring numbers of their names."""
    pairs = {path: _pairs(path.stem) for path in pictures}
    return [
        [(path, _row_and_column(path, found[number], order)) for path, found in pairs.items() if number < len(found)]
        for number in range(max(map(len, pairs.values()), default=0))
    ]


def _weight(named: _Named) -> int:
    """Return how likely places are those of views: by the pictures that have one, twice if they fill a rectangle."""
    return len(named) * (2 if _fill_a_rectangle([place for _, place in named]) else 1)


def _pairs(stem: str) -> list[tuple[int, int]]:
    """Return the whole numbers that stand side by side in a name.

    >>> _pairs("IMG_0001_03_12"), _pairs("out_03_12_-381.9_776.3_"), _pairs("view03_12")
    ([(1, 3), (3, 12)], [(3, 12)], [(3, 12)])
    """
    words = pairwise(_BETWEEN.split(stem))
    found = [(_FIRST_NUMBER.fullmatch(one), _SECOND_NUMBER.fullmatch(two)) for one, two in words]
    return [(int(one[1]), int(two[1])) for one, two in found if one and two]


def _row_and_column(path: Path, numbers: tuple[int, int], order: NameOrder | None) -> tuple[int, int]:
    return numbers[::-1] if (order or _usual_order(path)) == "column_row" else numbers


def _usual_order(path: Path) -> NameOrder:
    return "column_row" if _TWO_NUMBERS.fullmatch(path.stem) else "row_column"


def _order_note(path: Path) -> str:
    """Return a note about names that do not say which number is the row."""
    usual = _usual_order(path)
    other = "row_column" if usual == "column_row" else "column_row"
    first, second = usual.split("_")
    return (
        f"{path.name}: the first number of the view is taken for the {first} and the second for the {second}; give"
        f" --view-names {other} if it is the other way round."
    )


def _fill_a_rectangle(places: list[tuple[int, int]]) -> bool:
    spans = [len({place[axis] for place in places}) for axis in (0, 1)]
    return len(set(places)) == len(places) == math.prod(spans)


def _placed(named: _Named) -> dict[tuple[int, int], Path]:
    placed: dict[tuple[int, int], Path] = {}
    for path, place in named:
        if place in placed:
            raise BadInput(f"expected one view of row {place[0]} and column {place[1]}, got {placed[place]} and {path}")
        placed[place] = path
    return placed


def _whole(folder: Path, placed: Mapping[tuple[int, int], Path]) -> ViewFiles:
    """Return views by their places from 0, if none is missing."""
    tops = [min(place[axis] for place in placed) for axis in (0, 1)]
    rows, cols = (max(place[axis] for place in placed) - tops[axis] + 1 for axis in (0, 1))
    if len(placed) != rows * cols:
        missing = rows * cols - len(placed)
        raise BadInput(
            f"expected {cols} x {rows} views (columns x rows) in {folder}, got {len(placed)}: {missing} are missing"
        )
    return ViewFiles(rows, cols, {(row - tops[0], col - tops[1]): path for (row, col), path in placed.items()})
