"""The captions of Fig. 7 (what is real and what is virtual) against measured depths."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

Agreement = Literal["yes", "as a group", "no"]
"""True if measured depths agree with a caption: the fish and every stem, the fish and the mean of the stems, or not."""


@dataclass(frozen=True)
class Caption:
    """The caption of one position of the array."""

    letter: str
    text: str
    fish_is_real: bool
    stems_are_real: bool


CAPTIONS = (
    Caption("a", "the whole image is formed in front of the array: real", fish_is_real=True, stems_are_real=True),
    Caption("b", "the fish in front, the stems just behind", fish_is_real=True, stems_are_real=False),
    Caption("c", "the fish just in front, the stems behind", fish_is_real=True, stems_are_real=False),
    Caption("d", "the whole image is formed behind the array: virtual", fish_is_real=False, stems_are_real=False),
)


@dataclass(frozen=True)
class Depth:
    """The depth of one object, mm from the array of the capture, positive toward the observer."""

    name: str
    by_small_angles_mm: float
    by_exact_trace_mm: float
    measured_mm: float
    likeness: float
    """The correlation of the patches of all views, at most 1."""

    @property
    def is_real(self) -> bool:
        """True if it was measured in front of the array."""
        return self.measured_mm > 0


def agreement(caption: Caption, depths: Sequence[Depth]) -> Agreement:
    """Return whether the fish, which is first, and the stems were measured on the side that the caption names."""
    fish, *stems = depths
    if fish.is_real != caption.fish_is_real:
        return "no"
    if all(stem.is_real == caption.stems_are_real for stem in stems):
        return "yes"
    return "as a group" if (mean_mm(stems) > 0) == caption.stems_are_real else "no"


def mean_mm(depths: Sequence[Depth]) -> float:
    """Return the mean of measured depths, mm."""
    return sum(depth.measured_mm for depth in depths) / len(depths)
