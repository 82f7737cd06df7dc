"""Pictures of other programs as linear light: PNG, TIFF, EXR, whatever their numbers.

Whole numbers are decoded by the file's colour space (`worker.images.colour_space`); floating ones are linear light.
Alpha is left out, and what it covers is not darkened by it. Grey becomes three equal channels.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from OpenImageIO import ImageInput, ImageSpec

from lippmann.errors import ArtifactBroken
from lippmann.job.rig import MAX_FRAME_PX
from worker.images.colour_space import colour_space, light_of_codes, linear_space
from worker.images.read import checked, opened

FOREIGN_SUFFIXES = (".png", ".tif", ".tiff", ".exr")

_COLOURS = (("R", "G", "B"), ("r", "g", "b"), ("red", "green", "blue"))
_GREYS = (("Y",), ("I",), ("L",), ("grey",), ("gray",), ("luminance",))
_CODES = {"uint8", "uint16"}
_LIGHT = {"half", "float", "double"}


def read_imported(path: Path, *, linear: bool = False) -> NDArray[np.float32]:
    """Return a picture of any program as linear light, `(rows, cols, 3)`.

    Parameters
    ----------
    path
        A PNG, TIFF or EXR.
    linear
        Read codes as linear light, whatever colour space the file names.

    Raises
    ------
    ArtifactMissing
        If there is no such file.
    ArtifactBroken
        If it is no picture, is cut short, larger than a frame may be, or has other channels than red, green and blue,
        or grey.
    """
    # Else colours come multiplied by alpha.
    ask = ImageSpec()
    ask.attribute("oiio:UnassociatedAlpha", 1)
    with opened(path, ask) as source:
        spec = source.spec()
        places = _places(path, spec)
        kind = str(spec.format)
        if kind in _CODES:
            space = linear_space(None) if linear else colour_space(path, spec)
            return light_of_codes(_read(path, source, kind, places), space)
        if kind not in _LIGHT:
            raise ArtifactBroken(f"{path.name}: expected 8 or 16 bits, or floating numbers, got {kind}")
        return _read(path, source, "float", places).astype(np.float32, copy=False)


def _places(path: Path, spec: ImageSpec) -> list[int]:
    """Return the indices of red, green and blue among the channels; grey is all three."""
    if max(spec.height, spec.width) > MAX_FRAME_PX:
        raise ArtifactBroken(
            f"{path.name}: expected at most {MAX_FRAME_PX} px a side, got {spec.height} x {spec.width} px"
        )
    names = list(spec.channelnames)
    for wanted in _COLOURS:
        if all(name in names for name in wanted):
            return [names.index(name) for name in wanted]
    if len(names) == 1 or (len(names) == 2 and spec.alpha_channel == 1):
        return [0, 0, 0]
    for (grey,) in _GREYS:
        if grey in names:
            return [names.index(grey)] * 3
    raise ArtifactBroken(f"{path.name}: expected red, green and blue, or grey, got channels {tuple(names)}")


def _read(path: Path, source: ImageInput, kind: str, places: list[int]) -> NDArray[Any]:
    pixels = checked(path, source, source.read_image(0, 0, 0, max(places) + 1, kind))
    shaped = pixels.reshape(*pixels.shape[:2], -1)
    return np.ascontiguousarray(shaped[:, :, places])
