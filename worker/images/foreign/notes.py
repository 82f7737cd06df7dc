"""Notes for the user on the pictures of other programs, as sentences with the names of the files."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from worker.images.foreign.colour_space import colour_space
from worker.images.foreign.header import read_header
from worker.images.headers.picture import UPRIGHT, PictureHeader


def picture_notes(paths: Sequence[Path], *, linear: bool = False) -> tuple[str, ...]:
    """Return the notes about some pictures: each note once, with the first file.

    Parameters
    ----------
    paths
        The pictures.
    linear
        True if their codes are read as linear light, so that nothing is to be said of colour spaces.

    Raises
    ------
    ArtifactMissing
        If there is no such file.
    ArtifactBroken
        If its header cannot be read.
    """
    files: dict[str, list[Path]] = {}
    for path in paths:
        for note in header_notes(read_header(path), linear=linear):
            files.setdefault(note, []).append(path)
    return tuple(f"{_named(noted)}: {note}." for note, noted in files.items())


def header_notes(header: PictureHeader, *, linear: bool = False) -> Iterator[str]:
    """Yield the notes about a picture by its header, as sentences without the file's name.

    Parameters
    ----------
    header
        What the picture says of itself.
    linear
        As in `picture_notes`.
    """
    if header.quality is not None:
        about = "" if header.quality_is_exact else "about "
        chroma = f" with {header.chroma} chroma" if header.chroma else ""
        yield f"it is a JPEG of quality {about}{header.quality}{chroma}, whose losses stay in the cells"
    if header.orientation != UPRIGHT:
        yield f"its orientation tag is {header.orientation}, so it is turned upright"
    if header.has_more_parts:
        yield "it has several parts, of which the first is read"
    note = None if linear else colour_space(header).note
    if note is not None:
        yield note


def _named(paths: Sequence[Path]) -> str:
    others = len(paths) - 1
    return f"{paths[0].name} and {others} more" if others else paths[0].name
