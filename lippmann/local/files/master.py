"""Masters on disk: pixels, and the rig that the header of an EXR names."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from lippmann.errors import ArtifactBroken, BadInput, LayoutError
from lippmann.job.fields.problem_words import first_problem
from lippmann.job.optics.rig import Rig
from lippmann.job.scenes.stage import Stage
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.depth import depth_map
from lippmann.lightfield.depth.depth_map import DepthMap
from lippmann.lightfield.sheet.device import device_size
from lippmann.lightfield.sheet.lens_grid import device_grid
from lippmann.lightfield.sheet.rectify import rectify
from lippmann.plan import artifact_names as names
from lippmann.plan.sampling import device_pixels, display_size, frame_size
from worker.images.read import read_attributes
from worker.untrusted import read_depth_numbers, read_master_light

INTEGRAL = "integral"
"""The folder of the masters as captured, which are pseudoscopic."""

ORTHOSCOPIC = "orthoscopic"
"""The folder of the orthoscopic masters."""

DEVICE = "device"
"""The folder of the masters on the pixels of a device."""

DEPTH = "depth"
"""The folder of the depth of every pixel."""

CHANNELS = "channels"
"""The folder of the other channels of every pixel."""

OTHER_MASTERS = (INTEGRAL, "views", DEVICE, DEPTH, CHANNELS)
"""The folders of masters that are no orthoscopic integral images although their headers name the same rig."""


@dataclass(frozen=True)
class Master:
    """An integral image as its file holds it."""

    pixels: NDArray[np.float16]
    """`(rows, cols, 3)`, linear light."""
    layout: CellLayout
    rig: Rig
    pseudoscopic: bool

    @property
    def inverted(self) -> bool:
        """True if the imaging lens turned the picture of a pseudoscopic image upside down."""
        return self.pseudoscopic and self.rig.imaging_lens is not None


def read_master(path: Path) -> Master:
    """Read an integral image whose header names its rig.

    A master on the pixels of a device, `device/0001.exr`, is resampled to whole cells.

    Raises
    ------
    BadInput
        If it is no picture, its header names no rig, or it holds views or depths.
    lippmann.errors.ArtifactBroken
        If the file is damaged behind its header.
    """
    folder = path.absolute().parent.name
    if folder in OTHER_MASTERS and folder not in (INTEGRAL, DEVICE):
        raise BadInput(f"expected an orthoscopic master, as orthoscopic/{path.name}, got {path}")
    rig = named_rig(path)
    kind = read_attributes(path).get(names.KIND)
    pseudoscopic = folder == INTEGRAL if kind is None else kind == names.PSEUDOSCOPIC
    layout = frame_size(rig) if pseudoscopic else display_size(rig)
    pixels = read_master_light(path)
    if folder == DEVICE:
        pixels = _rectified(pixels, layout, rig, path)
    if pixels.shape[:2] != (layout.rows, layout.cols):
        raise BadInput(
            f"{path}: expected a master of {layout.cols} x {layout.rows} px for {layout}, got"
            f" {pixels.shape[1]} x {pixels.shape[0]} px"
        )
    return Master(pixels=pixels, layout=layout, rig=rig, pseudoscopic=pseudoscopic)


def depth_beside(master: Path) -> Path:
    """Return the path at which `fetch` and `capture` store the depth of an orthoscopic master."""
    return master.absolute().parent.parent / DEPTH / master.name


def read_depth(path: Path) -> DepthMap:
    """Read the depth of every pixel of an orthoscopic master.

    Raises
    ------
    ArtifactMissing, ArtifactBroken
        If there is no such file, or it is damaged.
    """
    return DepthMap(read_depth_numbers(path, depth_map.CHANNELS))


def channels_beside(master: Path) -> Path:
    """Return the path at which `fetch` and `capture` store the other channels of an orthoscopic master."""
    return master.absolute().parent.parent / CHANNELS / master.name


def _rectified(pixels: NDArray[np.float16], layout: CellLayout, rig: Rig, path: Path) -> NDArray[np.float16]:
    if rig.device is None:
        raise BadInput(f"{path}: expected a rig with a device in the header, got one without")
    device = device_pixels(rig.device, pitch_mm=rig.lens_array.pitch_mm)
    rows, cols = device_size(layout, **device)
    if pixels.shape[:2] != (rows, cols):
        raise BadInput(
            f"{path}: expected a master of {cols} x {rows} px on its device, got"
            f" {pixels.shape[1]} x {pixels.shape[0]} px"
        )
    with naming(path):
        return rectify(pixels, device_grid(layout, **device), layout)


def named_rig(path: Path) -> Rig:
    """Return the rig that the header of a master names.

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
    """Return the rig that the header of a master names; None if it names none.

    Raises
    ------
    BadInput
        If the picture is damaged, or the rig in its header is invalid.
    """
    with whole_picture(path):
        text = read_attributes(path).get("rig")
    try:
        return None if text is None else Rig.model_validate_json(text)
    except ValidationError as error:
        raise BadInput(f"{path}: the rig in the header: {first_problem(error)}") from error


def stage_in(path: Path) -> Stage | None:
    """Return the stage that the header of a master names; None if it names none.

    Raises
    ------
    BadInput
        If the stage in its header is invalid.
    """
    text = read_attributes(path).get("stage")
    try:
        return None if text is None else Stage.model_validate_json(text)
    except ValidationError as error:
        raise BadInput(f"{path}: the stage in the header: {first_problem(error)}") from error


@contextmanager
def whole_picture(path: Path) -> Iterator[None]:
    """Report a damaged picture as invalid input that names the file.

    Raises
    ------
    BadInput
        If the picture is damaged.
    """
    try:
        yield
    except ArtifactBroken as error:
        raise BadInput(f"expected a whole picture at {path}, got {error.message}") from error


@contextmanager
def naming(*files: Path) -> Iterator[None]:
    """Add the names of files to the message of a `LayoutError`.

    Raises
    ------
    LayoutError
        With the names of the files before its message.
    """
    try:
        yield
    except LayoutError as error:
        raise type(error)(f"{' and '.join(map(str, files))}: {error.message}") from error
