"""The pixels of a display and its lenses, from a master: which pixels, and which gap."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.job.optics.rig import Rig
from lippmann.job.optics.viewing import Bare, GapUse, Surround
from lippmann.job.spec import Display
from lippmann.lightfield.observer.display import LensDisplay
from lippmann.local.files.master import DEVICE, named_rig, naming, stage_in
from lippmann.local.image import open_orthoscopic
from lippmann.plan.design.observed_display import observed_display, reduced_mm, used_gap_mm
from worker.tasks.frames.assemble import on_device
from worker.untrusted import read_master_light


@dataclass(frozen=True)
class Gap:
    """The gap between pixels and lenses, given in one of three ways; one focal length if in none."""

    reduced_mm: float | None = None
    physical_mm: float | None = None
    """The gap as built, substrate included."""
    use: GapUse | None = None
    """The gap that `lippmann design` chooses for images of this kind."""

    def of(self, rig: Rig, file: Path) -> float | None:
        """Return the reduced gap, mm; None for one focal length.

        Parameters
        ----------
        rig
            The rig of the master.
        file
            The master, whose header may name the stage of its scene.

        Raises
        ------
        LayoutError, OpticsError
            If the gap cannot be built.
        """
        if self.physical_mm is not None:
            return reduced_mm(rig.lens_array, self.physical_mm)
        if self.use is not None:
            return used_gap_mm(rig, Display(), self.use, stage=stage_in(file))
        return self.reduced_mm


@dataclass(frozen=True)
class DisplayedImage:
    """The pixels of a display, and its lenses."""

    pixels: NDArray[np.floating[Any]]
    """`(rows, cols, 3)`, linear light: those of the integral image, or those of a device."""
    display: LensDisplay


def open_displayed_image(
    file: Path, *, gap: Gap, device: bool, bare: Bare, surround: Surround = "black"
) -> DisplayedImage:
    """Open a master as it is shown on a display.

    Parameters
    ----------
    file
        `orthoscopic/0001.exr`, or `device/0001.exr`, which has the pixels of the rig's device.
    gap
        The gap between pixels and lenses.
    device
        True to resample an orthoscopic master to the pixels of the rig's device.
    bare, surround
        What is visible where there is no lens, and beyond the pixels.

    Raises
    ------
    BadInput
        If the file is no orthoscopic master; see `open_orthoscopic`.
    LayoutError, OpticsError
        If the gap cannot be built, or there is no device.
    lippmann.errors.ArtifactBroken
        If the file is damaged behind its header.
    """
    is_device = file.absolute().parent.name == DEVICE and file.is_file()
    pixels = read_master_light(file) if is_device else open_orthoscopic(file).pixels
    rig = named_rig(file)
    with naming(file):
        gap_mm = gap.of(rig, file)
        display = observed_display(rig, gap_mm=gap_mm, on_device=is_device or device, bare=bare, surround=surround)
        if device and not is_device and rig.device is not None:
            pixels = on_device(pixels, display.layout, rig.device, pitch_mm=display.pitch_mm)
        display.check(pixels)
    return DisplayedImage(pixels=pixels, display=display)
