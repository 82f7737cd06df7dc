"""What the captions of Fig. 7 say is real and what virtual, against measured depths."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Caption:
    """What the paper says of one position."""

    letter: str
    words: str
    fish_real: bool
    stems_real: bool
    each_stem: bool = True
    """False: the stems as a group; they stand on both sides of the array."""


CAPTIONS = (
    Caption("a", "the whole image is formed in front of the array: real", fish_real=True, stems_real=True),
    Caption("b", "the fish in front, the stems just behind", fish_real=True, stems_real=False, each_stem=False),
    Caption("c", "the fish just in front, the stems behind", fish_real=True, stems_real=False),
    Caption("d", "the whole image is formed behind the array: virtual", fish_real=False, stems_real=False),
)


@dataclass(frozen=True)
class Depth:
    """Where one thing comes out, mm from the array of the capture, + toward the observer."""

    name: str
    by_small_angles_mm: float
    by_exact_trace_mm: float
    measured_mm: float
    likeness: float
    """Of the views' patches to each other, at most 1."""

    @property
    def is_real(self) -> bool:
        """Whether it was measured in front of the array."""
        return self.measured_mm > 0


def agrees(caption: Caption, depths: Sequence[Depth]) -> bool:
    """Return whether the fish, first, and the stems were measured on the side of the array where the caption has them.

    Where the caption speaks of the stems as a group, their mean counts.
    """
    fish, *stems = depths
    if caption.each_stem:
        right = all(stem.is_real == caption.stems_real for stem in stems)
    else:
        right = (mean_mm(stems) > 0) == caption.stems_real
    return fish.is_real == caption.fish_real and right


def mean_mm(depths: Sequence[Depth]) -> float:
    """Return the mean of measured depths."""
    return sum(depth.measured_mm for depth in depths) / len(depths)
