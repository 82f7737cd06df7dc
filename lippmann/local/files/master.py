"""An orthoscopic master from disk, with what its header says of the lenses over it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from lippmann.errors import ArtifactBroken, BadInput, LayoutError
from lippmann.job.rig import Rig
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.sheet.device import device_size
from lippmann.lightfield.sheet.lens_grid import device_grid
from lippmann.lightfield.sheet.rectify import whole_cells
from lippmann.plan.sampling import device_pixels, display_size
from worker.images.read import read_attributes, read_rgb

DEVICE = "device"
"""The folder of masters on a device's pixels."""

OTHER_MASTERS = ("integral", "views", DEVICE, "depth")
"""Folders of masters with the same header that are something else; some have the same size."""


@dataclass(frozen=True)
class Orthoscopic:
    """An orthoscopic integral image and its lenses."""

    sheet: NDArray[np.float16]
    """`(rows, cols, 3)`, linear light."""
    layout: CellLayout
    pitch_mm: float
    focal_mm: float
    """Of the lenses: the display's gap, too."""


def read_orthoscopic(path: Path) -> Orthoscopic:
    """Return an orthoscopic master, as `orthoscopic/0001.exr` of a job or a capture.

    One on a device's pixels, `device/0001.exr`, is brought back to whole cells.

    Raises
    ------
    BadInput
        If there is no such file, it is no picture, has no rig in its header, or is another master than this.
    lippmann.errors.ArtifactBroken
        If it is cut short or damaged behind its header.
    """
    if not path.is_file():
        raise BadInput(f"expected an orthoscopic master (EXR), got {path}, which is no file")
    folder = path.absolute().parent.name
    if folder in OTHER_MASTERS and folder != DEVICE:
        raise BadInput(f"expected an orthoscopic master, as orthoscopic/{path.name}, got {path}")
    rig = named_rig(path)
    layout, sheet = display_size(rig), read_rgb(path, np.float16)
    if folder == DEVICE:
        sheet = _from_device(sheet, layout, rig, path)
    if sheet.shape[:2] != (layout.rows, layout.cols):
        raise BadInput(
            f"{path}: expected an orthoscopic master of {layout.rows} x {layout.cols} px for {layout}, got"
            f" {sheet.shape[0]} x {sheet.shape[1]} px"
        )
    array = rig.lens_array
    return Orthoscopic(sheet=sheet, layout=layout, pitch_mm=array.pitch_mm, focal_mm=array.focal_length_mm)


def _from_device(shown: NDArray[np.float16], layout: CellLayout, rig: Rig, path: Path) -> NDArray[np.float16]:
    if rig.device is None:
        raise BadInput(f"{path}: expected a rig with a device in the header, got one without")
    pixels = device_pixels(rig.device, pitch_mm=rig.lens_array.pitch_mm)
    rows, cols = device_size(layout, **pixels)
    if shown.shape[:2] != (rows, cols):
        raise BadInput(
            f"{path}: expected a master of {rows} x {cols} px on its device, got {shown.shape[0]} x {shown.shape[1]} px"
        )
    try:
        return whole_cells(shown, device_grid(layout, **pixels), layout)
    except LayoutError as error:
        raise BadInput(f"{path}: {error.message}") from error


def named_rig(path: Path) -> Rig:
    """Return the rig that a master's header names.

    Raises
    ------
    BadInput
        If it names none, or as in `rig_in`.
    """
    rig = rig_in(path)
    if rig is None:
        raise BadInput(f"{path}: expected a master whose header names its rig, got a picture without lippmann:rig")
    return rig


def rig_in(path: Path) -> Rig | None:
    """Return the rig that a master's header names; None if it names none.

    Raises
    ------
    BadInput
        If it is no whole picture, or the header names something else.
    """
    with whole_picture(path):
        said = read_attributes(path).get("rig")
    try:
        return None if said is None else Rig.model_validate_json(said)
    except ValidationError as error:
        raise BadInput(f"{path}: expected a rig in the header, got {error.errors()[0]['msg']}") from error


@contextmanager
def whole_picture(path: Path) -> Iterator[None]:
    """Name a file that turns out to be broken while it is read.

    Raises
    ------
    BadInput
        If it does.
    """
    try:
        yield
    except ArtifactBroken as error:
        raise BadInput(f"expected a whole picture at {path}, got {error.message}") from error
