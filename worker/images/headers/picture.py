"""The header of a picture: size, channels, depth and colour."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import BinaryIO

PROFILE_BYTES_AT_MOST = 4 << 20
"""The largest ICC profile that is read; a larger one counts as none."""

ENTRIES_AT_MOST = 1000
"""The largest number of chunks, segments, attributes or tags that are looked at."""

UPRIGHT = 1
"""The orientation of a picture whose first row is its top and whose first column is its left side."""

ORIENTATIONS = range(1, 9)
"""The orientations of TIFF and EXIF (TIFF 6.0, tag 274)."""


SIDEWAYS = range(5, 9)
"""The orientations of a picture whose first row is its left or its right side."""


class DamagedHeader(Exception):
    """The header is cut short or makes no sense; the text continues "expected a whole header of a PNG, got"."""


@dataclass(frozen=True)
class PictureHeader:
    """The header of a picture, within the limits."""

    format: str
    rows: int
    cols: int
    """The size as it is stored, before the picture is turned upright."""
    channels: int
    pixel_bytes: int
    """The bytes of a pixel in memory, all channels."""
    is_light: bool
    """True if the numbers are floating ones."""
    icc: bytes | None = field(default=None, repr=False)
    """The ICC profile."""
    chunks: Mapping[bytes, bytes] = field(default_factory=dict, repr=False)
    """The chunks of a PNG that name its colour space."""
    block_px: int = 0
    """The pixels of the largest block that a reader must hold at once, such as a tile; 0 if the file names none."""
    texts: Mapping[str, str] = field(default_factory=dict, repr=False)
    """The attributes of an EXR that are texts."""
    orientation: int = UPRIGHT
    """The turn that makes the stored picture upright, as TIFF and EXIF number it."""
    pages: tuple[int, ...] = (0,)
    """The places of the pictures in the file; those of reduced size and of masks are left out."""
    page: int = 0
    """The number of the picture among `pages`."""
    foreign_colours: str = ""
    """The names of the channels if they are neither grey nor red, green and blue, such as `CMYK`."""
    has_more_parts: bool = False
    """True if an EXR has more parts than the first one, which alone is read."""
    highest_code: int = 0
    """The highest code that the file can hold, as 1023 of 10 bits; 0 if the numbers are floating ones."""
    white_is_zero: bool = False
    """True if 0 is white, as in a TIFF of the photometric interpretation 0."""
    quality: int | None = None
    """The quality of a JPEG as the IJG's library and most programs count it, 1 to 100; None if it is no JPEG."""
    quality_is_exact: bool = False
    """True if the tables of a JPEG are those of its quality; else they are the most like them."""
    chroma: str = ""
    """The chroma subsampling of a JPEG in colour, such as `4:2:0`."""

    @property
    def upright_size(self) -> tuple[int, int]:
        """The (rows, cols) of the picture once it is turned upright."""
        return (self.cols, self.rows) if self.orientation in SIDEWAYS else (self.rows, self.cols)

    @property
    def decoded_bytes(self) -> int:
        """The bytes of all pixels in memory."""
        return self.rows * self.cols * self.pixel_bytes


def read_bytes(file: BinaryIO, count: int) -> bytes:
    """Return the next bytes of a file.

    Raises
    ------
    DamagedHeader
        If there are not as many.
    """
    data = file.read(count)
    if len(data) < count:
        raise DamagedHeader("its beginning alone")
    return data


def known_orientation(number: int) -> int:
    """Return an orientation; any other number counts as upright."""
    return number if number in ORIENTATIONS else UPRIGHT
