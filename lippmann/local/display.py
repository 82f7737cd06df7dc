"""The display that a master would be shown on: pixels, lenses, gap."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import BadInput, LayoutError, OpticsError
from lippmann.job.rig import Rig
from lippmann.job.spec import Display
from lippmann.job.viewing import Bare, GapUse, Surround
from lippmann.lightfield.observer.display import LensDisplay
from lippmann.local.files.footage import stage_in
from lippmann.local.files.master import DEVICE, named_rig, read_orthoscopic
from lippmann.plan.design.observed_display import observed_display, reduced_mm, used_gap_mm
from worker.images.read import read_rgb
from worker.tasks.assemble import on_device


@dataclass(frozen=True)
class GapWish:
    """Which gap, said in one of three ways; one focal length when in none."""

    reduced_mm: float | None = None
    physical_mm: float | None = None
    """As built, substrate included."""
    use: GapUse | None = None
    """As `lippmann design` chooses it for the scene."""


@dataclass(frozen=True)
class Shown:
    """A display and what it shows."""

    sheet: NDArray[np.float16]
    """The display's pixels, `(rows, cols, 3)`, linear light."""
    display: LensDisplay


def read_shown(file: Path, *, gap: GapWish, device: bool, bare: Bare, surround: Surround = "black") -> Shown:
    """Return what a master shows.

    Parameters
    ----------
    file
        `orthoscopic/0001.exr`, or `device/0001.exr`, which has the pixels of the rig's device.
    gap
        Which gap.
    device
        Whether an orthoscopic master is put on the device's pixels first.
    bare, surround
        What is there where no lens is, and beyond the pixels.

    Raises
    ------
    BadInput
        If the gap cannot be built, there is no device, or as in `read_orthoscopic`.
    lippmann.errors.ArtifactBroken
        If the file is cut short or damaged behind its header.
    """
    is_device = file.absolute().parent.name == DEVICE and file.is_file()
    sheet = read_rgb(file, np.float16) if is_device else read_orthoscopic(file).sheet
    rig = named_rig(file)
    try:
        gap_mm = _gap_mm(gap, rig, file)
        display = observed_display(rig, gap_mm=gap_mm, on_device=is_device or device, bare=bare, surround=surround)
        if device and not is_device and rig.device is not None:
            sheet = on_device(sheet, display.layout, rig.device, pitch_mm=display.pitch_mm)
        display.check(sheet)
    except (LayoutError, OpticsError) as error:
        raise BadInput(f"{file}: {error.message}") from error
    return Shown(sheet=sheet, display=display)


def _gap_mm(gap: GapWish, rig: Rig, file: Path) -> float | None:
    if gap.physical_mm is not None:
        return reduced_mm(rig.lens_array, gap.physical_mm)
    if gap.use is not None:
        return used_gap_mm(rig, Display(), gap.use, stage=stage_in(file))
    return gap.reduced_mm
