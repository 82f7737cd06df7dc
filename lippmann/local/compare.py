"""Two orthoscopic integral images, or two folders of them, read and compared: which pictures, and which lenses."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from lippmann.errors import BadInput, LayoutError
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.quality.compare import Likeness, ViewLikeness, compare, compare_views
from lippmann.local.files.master import OTHER_MASTERS, rig_in, whole_picture
from lippmann.plan.sampling import display_size
from lippmann.terminal.progress import ProgressLine
from worker.images.codes import MASTER, SHOWN, picture_codes

ORTHOSCOPIC = "orthoscopic"
"""The folder of a job or a capture that is compared."""

_SAID = "--px-per-lens and --lens-count"
_NAMED_AT_MOST = 8


@dataclass(frozen=True)
class Pair:
    """One frame, twice."""

    name: str
    first: Path
    second: Path


@dataclass(frozen=True)
class Compared:
    """How alike the two are."""

    pair: Pair
    layout: CellLayout
    sheet: Likeness
    views: ViewLikeness


def compare_here(first: Path, second: Path, *, said: CellLayout | None) -> tuple[Compared, ...]:
    """Compare two pictures, or the frames of two folders by name.

    Parameters
    ----------
    first, second
        EXR or PNG files, or folders of them (or with a folder `orthoscopic/`), where an EXR goes before a PNG.
    said
        The lenses over them, if the user says; else as the header of an EXR says.

    Raises
    ------
    BadInput
        If there is no such pair, a frame is missing, a picture cannot be read, the sizes differ, or the lenses are not
        known or not the same.
    """
    pairs = find_pairs(first, second)
    compared = []
    with ProgressLine("compare") as line:
        for number, pair in enumerate(pairs):
            compared.append(_compared(pair, said))
            if len(pairs) > 1:
                line.show((number + 1) / len(pairs), pair.name)
    return tuple(compared)


def find_pairs(first: Path, second: Path) -> tuple[Pair, ...]:
    """Return the pictures that belong together: two files, or the frames of two folders by name."""
    for path in (first, second):
        if not path.exists():
            raise BadInput(f"expected a picture or a folder of pictures, got {path}, which is not there")
    if first.is_dir() != second.is_dir():
        folder, picture = (first, second) if first.is_dir() else (second, first)
        raise BadInput(f"expected two pictures or two folders, got the folder {folder} and the picture {picture}")
    if not first.is_dir():
        return (Pair(first.stem, _checked(first), _checked(second)),)
    frames, others = find_frames(first), find_frames(second)
    missing = [_missing(frames, others, second), _missing(others, frames, first)]
    if any(missing):
        raise BadInput(f"expected the same frames twice, got {' and '.join(filter(None, missing))}")
    return tuple(Pair(name, frames[name], others[name]) for name in sorted(frames))


def find_frames(folder: Path) -> dict[str, Path]:
    """Return the orthoscopic frames of a folder, or of its `orthoscopic/`, by name; an EXR goes before a PNG.

    Raises
    ------
    BadInput
        If there are none, or they are another kind of master.
    """
    inside = folder / ORTHOSCOPIC if (folder / ORTHOSCOPIC).is_dir() else folder
    # The later go before the earlier: masters are read where there are both.
    found = [path for suffix in (SHOWN, MASTER) for path in inside.iterdir() if path.suffix.lower() == suffix]
    if not found:
        raise BadInput(f"expected frames as EXR or PNG in {inside}, got none")
    return {path.stem: _checked(path) for path in found}


def _missing(frames: dict[str, Path], others: dict[str, Path], folder: Path) -> str:
    names = sorted(frames.keys() - others.keys())
    more = f" and {len(names) - _NAMED_AT_MOST} more" if len(names) > _NAMED_AT_MOST else ""
    return f"no {', '.join(names[:_NAMED_AT_MOST])}{more} in {folder}" if names else ""


def _checked(path: Path) -> Path:
    if path.suffix.lower() not in (MASTER, SHOWN):
        raise BadInput(f"expected an EXR or a PNG, got {path}")
    if path.absolute().parent.name in OTHER_MASTERS:
        raise BadInput(f"expected an orthoscopic integral image, as {ORTHOSCOPIC}/{path.name}, got {path}")
    return path


def _compared(pair: Pair, said: CellLayout | None) -> Compared:
    layout = _layout(pair, said)
    with whole_picture(pair.first):
        first = picture_codes(pair.first)
    with whole_picture(pair.second):
        second = picture_codes(pair.second)
    try:
        return Compared(pair, layout, compare(first, second), compare_views(first, second, layout))
    except LayoutError as error:
        raise BadInput(f"{pair.first} and {pair.second}: {error.message}") from error


def _layout(pair: Pair, said: CellLayout | None) -> CellLayout:
    """Return the lenses over both pictures, which everyone who knows them must say alike."""
    found = {str(path): _layout_in(path) for path in (pair.first, pair.second)}
    known = {who: layout for who, layout in {**found, _SAID: said}.items() if layout is not None}
    if not known:
        raise BadInput(
            f"expected {_SAID}, or a master (EXR) whose header names its rig, got neither for {pair.first} and"
            f" {pair.second}"
        )
    if len(set(known.values())) > 1:
        says = "; ".join(f"{layout} by {who}" for who, layout in known.items())
        raise BadInput(f"expected the same lenses over both, got {says}")
    return next(iter(known.values()))


def _layout_in(path: Path) -> CellLayout | None:
    if path.suffix.lower() != MASTER:
        return None
    rig = rig_in(path)
    return None if rig is None else display_size(rig)
