"""EXR and PNG to arrays.

Every read is checked: a file cut short opens, and then reads as nothing.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import OpenImageIO
from numpy.typing import NDArray
from OpenImageIO import ImageInput, geterror

from lippmann.errors import ArtifactBroken
from worker.images.foreign.header import read_header

Light = TypeVar("Light", bound=np.floating[Any])

SUFFIXES = {
    "PNG": (".png",),
    "TIFF": (".tif", ".tiff"),
    "EXR": (".exr",),
    "JPEG": (".jpg", ".jpeg"),
    "PFM": (".pfm",),
    "PNM": (".pnm", ".ppm", ".pgm"),
}
"""The suffixes by which OpenImageIO knows a format."""

ATTRIBUTE_PREFIX = "lippmann:"
"""The prefix of our own EXR header attributes."""

_CHANNELS = ("R", "G", "B")


def read_rgb(path: Path, dtype: type[Light]) -> NDArray[Light]:
    """Return the red, green and blue of a linear picture.

    Parameters
    ----------
    path
        An EXR file; an alpha channel is left out.
    dtype
        `np.float16` keeps the half floats of a master as they are, `np.float32` is for arithmetic.

    Returns
    -------
    NDArray
        `(rows, cols, 3)`.

    Raises
    ------
    ArtifactMissing
        If there is no such file.
    ArtifactBroken
        If it is not a picture, is cut short or damaged, or does not have the three channels.
    """
    with opened(path) as source:
        check_channels(path, source)
        return checked(path, source, source.read_image(0, 0, 0, 3, _name(dtype)))


def read_channels(path: Path, names: Sequence[str]) -> NDArray[np.float32]:
    """Return channels of an EXR by their names, `(rows, cols, channel)`: numbers, not light.

    Raises
    ------
    ArtifactMissing
        If there is no such file.
    ArtifactBroken
        If it is not a picture, is cut short or damaged, or does not have these channels.
    """
    with opened(path) as source:
        places = channel_places(path, source, names)
        pixels = checked(path, source, source.read_image(0, 0, 0, max(places) + 1, "float"))
        return np.ascontiguousarray(pixels[..., places])


def read_attributes(path: Path) -> dict[str, str]:
    """Return our own attributes in the header of an EXR, without their prefix; see `write_exr`.

    Raises
    ------
    ArtifactMissing
        If there is no such file.
    ArtifactBroken
        If its header cannot be read.
    """
    texts = read_header(path).texts
    return {
        name.removeprefix(ATTRIBUTE_PREFIX): text for name, text in texts.items() if name.startswith(ATTRIBUTE_PREFIX)
    }


@contextmanager
def opened(path: Path) -> Iterator[ImageInput]:
    """Yield an open picture of one of `worker.images.foreign.header.FORMATS`; errors are those of `read_rgb`.

    The content chooses the one reader that sees the file, and the header is checked before.
    """
    suffixes = SUFFIXES[read_header(path).format]
    # OpenImageIO chooses the reader by the suffix, and else tries all that it has.
    OpenImageIO.attribute("try_all_readers", 0)
    with utf8_path(path, suffixes) as name:
        source = ImageInput.open(name)
        if source is None:
            raise ArtifactBroken(f"{path.name}: {_words(geterror())}")
        try:
            yield source
        finally:
            source.close()


@contextmanager
def utf8_path(path: Path, suffixes: Sequence[str] = ()) -> Iterator[str]:
    """Yield a path that OpenImageIO can open: the path itself, or a symbolic link to it.

    OpenImageIO takes paths as UTF-8 only, and reads settings after a question mark. A file that is written through the
    link is created at `path`. If `suffixes` are given, the path that is yielded has one of them.
    """
    suffix = path.suffix.encode("ascii", "ignore").decode()
    fits = not suffixes or suffix.lower() in suffixes
    if not fits or "?" in str(path) or not _is_utf8(path):
        with tempfile.TemporaryDirectory(prefix="lippmann-") as folder:
            link = Path(folder, "picture" + (suffix if fits else suffixes[0]))
            link.symlink_to(path.absolute())
            yield str(link)
    else:
        yield str(path)


def _is_utf8(path: Path) -> bool:
    try:
        str(path).encode("utf-8")
    except UnicodeEncodeError:
        return False
    return True


def channel_places(path: Path, source: ImageInput, names: Sequence[str]) -> list[int]:
    """Return where channels of these names are among those of a picture, which may have others."""
    there = tuple(source.spec().channelnames)
    if not set(names) <= set(there):
        raise ArtifactBroken(f"{path.name}: expected channels {tuple(names)}, got {there}")
    return [there.index(name) for name in names]


def check_channels(path: Path, source: ImageInput) -> None:
    """Refuse a picture whose first three channels are not red, green and blue."""
    names = tuple(source.spec().channelnames)
    if names[:3] != _CHANNELS:
        raise ArtifactBroken(f"{path.name}: expected channels {_CHANNELS}, got {names}")


def checked(path: Path, source: ImageInput, pixels: NDArray[Any] | None) -> NDArray[Any]:
    """Return the pixels that were read, if they are complete."""
    # Some readers return the rows that they have, and report the missing rows only as an error.
    trouble = source.geterror()
    if pixels is None or trouble:
        raise ArtifactBroken(f"{path.name}: {_words(trouble)}")
    return pixels


def _name(dtype: type[Any]) -> str:
    return {"float16": "half", "float32": "float"}[np.dtype(dtype).name]


def _words(trouble: str) -> str:
    return " ".join(trouble.split()) or "cannot be read"


def limit_threads(count: int) -> None:
    """Limit OpenImageIO to `count` threads in this process, for files and for arithmetic.

    Without this it uses one thread per core, which is too many where every core has its own worker. It starts threads,
    so call it in the working child process, never in a parent that forks.
    """
    if count < 1:
        raise ValueError(f"expected at least one thread, got {count}")
    OpenImageIO.attribute("threads", count)
    # For OpenEXR 0 would mean one a core, and -1 means in the calling thread.
    OpenImageIO.attribute("exr_threads", -1 if count == 1 else count)
