"""Drawings to scale as SVG text: elements, panels that turn millimetres into pixels, labels that do not overlap."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from xml.sax.saxutils import escape, quoteattr

LETTER_PX = 6.7
"""The mean width of a letter of the labels, whose size is 12 px."""
LABEL_ROW_PX = 16.0
BESIDE_PX = 4.5
"""The distance from a leader to the text beside it, px."""
MOST_TRIES = 10_000
"""Places that are tried for the labels of a panel, about 50 ms: to try all takes exponentially long."""


def element(name: str, *inside: str, text: str = "", **attributes: str | float) -> str:
    """Return an element. Numbers have two decimals; in names a trailing underscore is removed and others become dashes.

    Parameters
    ----------
    name
        The name of the element.
    *inside
        The elements inside it, as text.
    text
        The text inside it, which is escaped.
    **attributes
        The attributes by name, text or numbers.

    Examples
    --------
    >>> element("text", text="a < b", x=1.0, class_="label")
    '<text x="1" class="label">a &lt; b</text>'
    """
    said = "".join(
        f" {key.rstrip('_').replace('_', '-')}={quoteattr(number(value))}" for key, value in attributes.items()
    )
    within = escape(_legal(text)) + "".join(inside)
    return f"<{name}{said}>{within}</{name}>" if within else f"<{name}{said}/>"


def number(value: str | float) -> str:
    """Return a number with at most two decimals, and text as it is."""
    return _legal(value) if isinstance(value, str) else f"{value + 0.0:.2f}".rstrip("0").rstrip(".")


def _legal(text: str) -> str:
    """Return text without unprintable characters, some of which are not allowed in XML."""
    return "".join(letter for letter in text if letter.isprintable())


@dataclass(frozen=True)
class Panel:
    """A part of a drawing: one scale for both directions, the optical axis at `axis_px`."""

    left_px: float
    axis_px: float
    px_per_mm: float
    from_mm: float
    """The z at the left edge."""
    to_mm: float
    half_mm: float
    """Half the height of the panel."""

    def x(self, z_mm: float) -> float:
        """Return the position of a z, px from the left."""
        return self.left_px + (z_mm - self.from_mm) * self.px_per_mm

    def y(self, height_mm: float) -> float:
        """Return the position of a height above the axis, px from the top."""
        return self.axis_px - height_mm * self.px_per_mm

    @property
    def top_px(self) -> float:
        """The upper edge of the panel, px."""
        return self.y(self.half_mm)

    @property
    def bottom_px(self) -> float:
        """The lower edge of the panel, px."""
        return self.y(-self.half_mm)

    def points(self, points_mm: Iterable[tuple[float, float]]) -> str:
        """Return (z, height) points as the `points` attribute of SVG."""
        return " ".join(f"{number(self.x(z))},{number(self.y(height))}" for z, height in points_mm)

    def line(self, points_mm: Iterable[tuple[float, float]], class_: str) -> str:
        """Return a line through (z, height) points.

        Parameters
        ----------
        points_mm
            The points as (z, height), mm.
        class_
            The class of the line in the style sheet.
        """
        return element("polyline", points=self.points(points_mm), class_=class_)


@dataclass(frozen=True)
class Label:
    """A text over a panel with the leader that goes down from it."""

    text: str
    x_px: float
    """The position of the leader, px."""
    left_px: float
    row: int
    """The number of the row, counted upward from the lowest one."""

    @property
    def right_px(self) -> float:
        """The right end of the text, px."""
        return self.left_px + _length_px(self.text)

    def is_clear_of(self, other: Label) -> bool:
        """Return True if neither text overlaps the other, nor the other's leader."""
        together = self.left_px < other.right_px + 8 and other.left_px < self.right_px + 8
        if self.row == other.row:
            return not together
        higher, lower = (self, other) if self.row > other.row else (other, self)
        return not lower.left_px - 3 < higher.x_px < lower.right_px + 3


Wanted = Sequence[tuple[float, str]]
"""Leaders and their texts, from left to right, px."""


def placed_labels(panel: Panel, marks: Sequence[tuple[float, str]], *, width_px: float) -> tuple[Label, ...]:
    """Return positions for labels so that none overlaps another, and almost always none a leader.

    Parameters
    ----------
    panel
        The panel that is drawn on.
    marks
        The z place in mm and the text of each label.
    width_px
        The width of a label, px.
    """
    wanted = sorted((panel.x(z_mm), text) for z_mm, text in marks)
    tries = iter(range(MOST_TRIES))
    for rows in range(1, len(wanted) + 1):
        found = _placed(wanted, (), rows, width_px, tries)
        if found is not None:
            return found
    return _flags(wanted, width_px)


def labels(panel: Panel, placed: Iterable[Label]) -> list[str]:
    """Return placed labels over a panel, each with a leader down to it.

    Parameters
    ----------
    panel
        The panel that is drawn on.
    placed
        The labels with their places.
    """
    shown: list[str] = []
    for label in placed:
        base_px = panel.top_px - 8 - label.row * LABEL_ROW_PX
        shown.append(element("text", text=label.text, x=label.left_px, y=base_px, class_="label"))
        shown.append(
            element("line", x1=label.x_px, x2=label.x_px, y1=base_px + 4, y2=panel.top_px + 2, class_="leader")
        )
    return shown


def _placed(
    wanted: Wanted, before: tuple[Label, ...], rows: int, width_px: float, tries: Iterator[int]
) -> tuple[Label, ...] | None:
    """Return `before` and positions for the labels that follow; None if the rows, or the tries, do not suffice."""
    if len(before) == len(wanted):
        return before
    x_px, text = wanted[len(before)]
    for row in range(rows):
        for start_px in _starts(x_px, text, width_px):
            if next(tries, None) is None:
                return None
            place = Label(text, x_px, start_px, row)
            if all(map(place.is_clear_of, before)):
                found = _placed(wanted, (*before, place), rows, width_px, tries)
                if found is not None:
                    return found
    return None


def _starts(x_px: float, text: str, width_px: float) -> list[float]:
    """Return the possible starts of a text inside the drawing: above its leader, to its left, to its right."""
    length_px = _length_px(text)
    starts = [x_px - length_px / 2, x_px - length_px + 4, x_px - 4]
    return [start for start in starts if 8 <= start <= width_px - length_px - 8] or [max(8.0, starts[1])]


def _flags(wanted: Wanted, width_px: float) -> tuple[Label, ...]:
    """Return positions for labels that are too close: texts beside their leaders, which may then coincide.

    All texts are at the right of their leaders, and a leader farther left is higher and passes all of them. If there is
    no room, the texts are at the left. Both orders of rows are tried.
    """
    to_right = [Label(text, x_px, x_px + BESIDE_PX, 0) for x_px, text in reversed(wanted)]
    right = [flag for flag in to_right if flag.right_px <= width_px - 8]
    away = [flag for flag in reversed(to_right) if flag not in right]
    left = [replace(flag, left_px=max(8.0, flag.x_px - BESIDE_PX - _length_px(flag.text))) for flag in away]
    return min((_stacked(left + right), _stacked(right + left)), key=_crossings)


def _stacked(flags: Sequence[Label]) -> tuple[Label, ...]:
    """Return labels in the lowest rows in which they overlap none of the previous labels; else above all of them."""
    placed: list[Label] = []
    for flag in flags:
        tried = [replace(flag, row=row) for row in range(len(placed) + 1)]
        placed.append(next((one for one in tried if all(map(one.is_clear_of, placed))), tried[-1]))
    return tuple(placed)


def _crossings(placed: Sequence[Label]) -> int:
    return sum(not one.is_clear_of(other) for one, other in combinations(placed, 2))


def _length_px(text: str) -> float:
    return len(text) * LETTER_PX


def scale_bar(panel: Panel) -> list[str]:
    """Return a scale bar of a round length at the lower left of the panel."""
    length_mm = round_length_mm(100 / panel.px_per_mm)
    y_px, start_px = panel.bottom_px + 14, panel.left_px
    end_px = start_px + length_mm * panel.px_per_mm
    ticks = f"M{number(start_px)} {number(y_px - 4)}v8M{number(start_px)} {number(y_px)}H{number(end_px)}m0 -4v8"
    text = element("text", text=f"{length_mm:g} mm", x=end_px + 8, y=y_px + 4, class_="label")
    return [element("path", d=ticks, class_="bar"), text]


def round_length_mm(about_mm: float) -> float:
    """Return the greatest of 1, 2, 5, 10, ... that is not above a length.

    >>> round_length_mm(73.0), round_length_mm(0.3)
    (50.0, 0.2)
    """
    power = 10.0 ** math.floor(math.log10(about_mm))
    return max(step * power for step in (1.0, 2.0, 5.0) if step * power <= about_mm * (1 + 1e-9))
