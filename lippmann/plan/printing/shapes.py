"""Black shapes on a page, in mm from its upper left corner."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Bar:
    """A filled rectangle, also for lines."""

    left_mm: float
    top_mm: float
    width_mm: float
    height_mm: float

    @property
    def right_mm(self) -> float:
        """The right end."""
        return self.left_mm + self.width_mm

    @property
    def bottom_mm(self) -> float:
        """The lower end."""
        return self.top_mm + self.height_mm


@dataclass(frozen=True)
class Ring:
    """A circle drawn with a line."""

    x_mm: float
    y_mm: float
    radius_mm: float
    line_mm: float


@dataclass(frozen=True)
class TextLine:
    """A line of text, whose baseline is `baseline_mm`."""

    x_mm: float
    """The beginning of the text, or its middle."""
    baseline_mm: float
    size_mm: float
    text: str
    centred: bool = False


Shape = Bar | Ring | TextLine


def line(x0_mm: float, y0_mm: float, x1_mm: float, y1_mm: float, *, line_mm: float) -> Bar:
    """Return a vertical or horizontal line between two points, left to right or top to bottom, with square ends.

    >>> line(0, 5, 10, 5, line_mm=0.5)
    Bar(left_mm=0, top_mm=4.75, width_mm=10, height_mm=0.5)
    """
    if y0_mm == y1_mm:
        return Bar(x0_mm, y0_mm - line_mm / 2, x1_mm - x0_mm, line_mm)
    return Bar(x0_mm - line_mm / 2, y0_mm, line_mm, y1_mm - y0_mm)
