"""Pictures of other programs as the frames of an import: one of a file, or every page of a TIFF."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import BadInput
from lippmann.job.optics.rig import MAX_FRAME_PX
from lippmann.job.scenes.imported_sheets import SUFFIXES
from lippmann.local.files.master import whole_picture
from worker.images.foreign.colour_space import colour_space, light_of_codes, linear_space
from worker.images.foreign.header import read_header
from worker.settings import WorkerSettings
from worker.untrusted import read_imported

SENSOR_BITS = (10, 12, 14)
"""The bits of sensors whose numbers are often stored as they are in 16 bits."""


@dataclass(frozen=True)
class Decoding:
    """The way in which the numbers of pictures become light."""

    linear: bool = False
    """True to take codes for linear light, whatever the files say."""
    white_level: int | None = None
    """The code of white; None for the highest code of a file."""


@dataclass(frozen=True)
class SourcePicture:
    """A picture in a file."""

    path: Path
    page: int | None = None
    """The number of the page, from 0; None if the file has only one."""

    def __str__(self) -> str:
        """Return the path, with the page as a bundle names it."""
        return f"{self.path}{self.page_mark}"

    @property
    def page_mark(self) -> str:
        """The text that names the page behind the name of the file; empty if there is only one."""
        return "" if self.page is None else f"#{self.page + 1}"

    @property
    def name(self) -> str:
        """The name of the file, with the page."""
        return f"{self.path.name}{self.page_mark}"


def source_pictures(files: Sequence[Path]) -> tuple[SourcePicture, ...]:
    """Return the pictures of files in their order; those of reduced size in a TIFF are left out.

    Raises
    ------
    BadInput
        If a file is missing, is not a picture, or its header is damaged.
    """
    return tuple(picture for path in files for picture in _pictures_in(path))


def page_notes(pictures: Sequence[SourcePicture]) -> Iterator[str]:
    """Yield notes about the files whose pages become frames."""
    files = dict.fromkeys(picture.path for picture in pictures if picture.page is not None)
    for path in files:
        frames = [place + 1 for place, picture in enumerate(pictures) if picture.path == path]
        yield f"{path.name}: its {len(frames)} pages are the frames {frames[0]} to {frames[-1]}."


def read_picture(picture: SourcePicture, decoding: Decoding) -> NDArray[np.float32]:
    """Return a picture as linear light, upright, `(rows, cols, 3)`.

    Parameters
    ----------
    picture
        The picture.
    decoding
        The way in which its numbers become light.

    Raises
    ------
    BadInput
        If it is damaged, too large, or of other channels than red, green and blue, or grey.
    """
    check_suffix(picture.path)
    with whole_picture(picture.path):
        return read_imported(picture.path, page=picture.page, linear=decoding.linear, white_level=decoding.white_level)


def upright_size(picture: SourcePicture) -> tuple[int, int]:
    """Return the (rows, cols) of a picture by its header, upright, within the limits of pictures that are decoded.

    Raises
    ------
    BadInput
        If it is no picture, its header is damaged, it is too large, or has several pages of which none is named.
    """
    check_suffix(picture.path)
    limits = {"at_most_px": WorkerSettings().picture_px, "at_most_side_px": MAX_FRAME_PX}
    with whole_picture(picture.path):
        header = read_header(picture.path, page=picture.page or 0, **limits)
    if picture.page is None and len(header.pages) > 1:
        raise BadInput(f"expected one picture, got {len(header.pages)} pages in {picture.path}")
    return header.upright_size


def check_suffix(path: Path) -> None:
    """Refuse a file that is not there, or that is no picture by its suffix.

    Raises
    ------
    BadInput
        The error names the file.
    """
    if path.suffix.lower() not in SUFFIXES:
        raise BadInput(f"expected a picture as {', '.join(SUFFIXES)}, got {path}")
    if not path.is_file():
        raise BadInput(f"expected a picture at {path}, got no file")


def unused_bits_note(picture: SourcePicture, light: NDArray[np.float32], decoding: Decoding) -> str | None:
    """Return a note if a picture of 16 bits looks as if a sensor of fewer bits had written its numbers.

    Parameters
    ----------
    picture
        The picture.
    light
        Its light, as it was read.
    decoding
        The way in which it was read.
    """
    header = read_header(picture.path, page=picture.page or 0)
    if decoding.white_level is not None or header.is_light or header.pixel_bytes != 2 * header.channels:
        return None
    if header.white_is_zero or header.highest_code != np.iinfo(np.uint16).max:
        return None  # The white of such a file cannot be given.
    space = linear_space(None) if decoding.linear else colour_space(header)
    codes = np.array([2**bits - 1 for bits in SENSOR_BITS], dtype=np.uint16)
    brightest = float(light.max())
    for bits, code, highest in zip(SENSOR_BITS, codes, light_of_codes(codes, space), strict=True):
        if 0 < brightest <= highest:
            return (
                f"{picture.name}: its codes have 16 bits, and none is above {code}. If a sensor of {bits} bits wrote"
                f" them, give --white-level {code}, and --linear if they are proportional to light."
            )
    return None


def not_finite_notes(picture: SourcePicture, light: NDArray[np.float32]) -> Iterator[str]:
    """Yield a note if numbers of a picture are not finite; they are kept.

    Parameters
    ----------
    picture
        The picture.
    light
        Its light, as it was read.
    """
    count = light.size - np.count_nonzero(np.isfinite(light))
    if count:
        yield f"{picture.name}: {count} of its {light.size} numbers are not finite; they are kept."


def _pictures_in(path: Path) -> tuple[SourcePicture, ...]:
    check_suffix(path)
    with whole_picture(path):
        pages = len(read_header(path).pages)
    return tuple(SourcePicture(path, page) for page in range(pages)) if pages > 1 else (SourcePicture(path),)
