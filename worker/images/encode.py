"""Encode pixels to a file in memory, and write that to disk.

OpenImageIO has no way to write to bytes, and on a full disk it cannot be trusted: its PNG writer reports
success and its WebP writer never returns (3.2.2, measured). So it writes to memory, and Python, which reports such
errors, writes to disk.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO, Literal

import numpy as np
from numpy.typing import NDArray
from OpenImageIO import ImageOutput, ImageSpec, geterror

from lippmann.errors import OutputError
from worker.whole_file import new_file

Format = Literal["png", "webp", "openexr"]


@contextmanager
def encoded(
    pixels: NDArray[Any],
    *,
    to: Format,
    store_as: str,
    attributes: Mapping[str, str | int | float],
) -> Iterator[BinaryIO]:
    """Yield a picture as an open file in memory, positioned at its beginning.

    Parameters
    ----------
    pixels
        `(rows, cols, channel)`.
    to
        The file format, by OpenImageIO's name.
    store_as
        The type of its numbers, by OpenImageIO's name: `uint8`, `uint16`, `float`.
    attributes
        Header attributes and settings of the writer.

    Raises
    ------
    OutputError
        If the picture cannot be written in this format.
    """
    rows, cols, count = pixels.shape
    spec = ImageSpec(cols, rows, count, store_as)
    for name, value in attributes.items():
        spec.attribute(name, value)
    with open(os.memfd_create("picture", os.MFD_CLOEXEC), "w+b") as file:
        _write(f"/proc/self/fd/{file.fileno()}", spec, np.ascontiguousarray(pixels), to)
        yield file


def save(file: BinaryIO, path: Path) -> None:
    """Write an open file to disk; an incomplete file is removed.

    Raises
    ------
    DiskFull
        If there is no room.
    DiskUnavailable
        If the folder cannot be written to.
    """
    with new_file(path) as target:
        shutil.copyfileobj(file, target, 1 << 20)


def _write(path: str, spec: ImageSpec, pixels: NDArray[Any], to: Format) -> None:
    target = ImageOutput.create(to)
    if target is None:
        raise OutputError(f"this OpenImageIO writes no {to}: {geterror()}")
    # Each step is checked: closing a file that was never opened reports success.
    whole = target.open(path, spec) and target.write_image(pixels) and target.close()
    trouble = target.geterror()
    if not whole or trouble:
        raise OutputError(f"cannot write {spec.height} x {spec.width} px as {to}: {trouble}")
