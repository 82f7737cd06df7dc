"""The gap between the pixels and the lenses: that of the job, otherwise the one for the depths of its scene."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from lippmann.job.optics.rig import LensArray
from lippmann.job.optics.viewing import GapUse
from lippmann.job.spec import Display
from lippmann.optics.rig import display as optics


@dataclass(frozen=True)
class Gap:
    """A gap, reduced and as built."""

    reduced_mm: float
    physical_mm: float
    """The gap as built, including the substrate."""


def gaps(array: LensArray, shown: Display, *, near_mm: float, far_mm: float) -> Mapping[GapUse, Gap]:
    """Return the gaps for a scene between two depths.

    Parameters
    ----------
    array
        The lenses.
    shown
        The display of the job; gaps that it names are used.
    near_mm, far_mm
        Depths s of the scene's near and far plane.
    """
    f_mm, contact_mm = array.focal_length_mm, contact_gap_mm(array)
    chosen = {"focal_length_mm": f_mm, "contact_mm": contact_mm}
    wanted_mm: dict[GapUse, float] = {
        "real": optics.chosen_gap_mm(max(0.0, far_mm), max(0.0, near_mm), **chosen),
        "virtual": optics.chosen_gap_mm(min(0.0, near_mm), min(0.0, far_mm), **chosen),
        "collimated": f_mm,
    }
    asked_mm = {"real": shown.gap_real_mm, "virtual": shown.gap_virtual_mm}
    return {use: _gap(array, asked_mm.get(use), gap_mm) for use, gap_mm in wanted_mm.items()}


def contact_gap_mm(array: LensArray) -> float:
    """Return the smallest reduced gap, in which the substrate touches the pixels."""
    return array.substrate_mm / array.index


def _gap(array: LensArray, asked_mm: float | None, wanted_mm: float) -> Gap:
    glass = {"substrate_mm": array.substrate_mm, "index": array.index}
    if asked_mm is not None:
        return Gap(reduced_mm=optics.reduced_gap_mm(asked_mm, **glass), physical_mm=asked_mm)
    return Gap(reduced_mm=wanted_mm, physical_mm=optics.physical_gap_mm(wanted_mm, **glass))
