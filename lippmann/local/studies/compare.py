"""Compare two orthoscopic integral images on disk, or the frames of two folders."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from lippmann.errors import BadInput
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.quality.compare import Similarity, ViewSimilarity, compare, compare_views
from lippmann.local.files.master import ORTHOSCOPIC, OTHER_MASTERS, naming, rig_in, whole_picture
from lippmann.plan.sampling import display_size
from lippmann.terminal.progress import ProgressLine
from worker.images.convert import MASTER, SHOWN
from worker.images.foreign.notes import picture_notes
from worker.untrusted import picture_codes

_OPTIONS = "--px-per-lens and --lenses"
_NAMED_AT_MOST = 8


@dataclass(frozen=True)
class Pair:
    """The two files of one frame."""

    name: str
    first: Path
    second: Path


@dataclass(frozen=True)
class Comparison:
    """The similarity of the two pictures of a frame."""

    pair: Pair
    layout: CellLayout
    sheet: Similarity
    views: ViewSimilarity


def compare_files(
    first: Path, second: Path, *, layout: CellLayout | None, linear: bool = False
) -> tuple[Comparison, ...]:
    """Compare two pictures, or the frames of two folders by name.

    Parameters
    ----------
    first, second
        EXR or PNG files, or folders of them (or with a folder `orthoscopic/`), in which an EXR is preferred to a PNG.
    layout
        The lenses over both, if no header names them.
    linear
        True to take the codes of PNG files for linear light, whatever the files say.

    Raises
    ------
    BadInput
        If there is no such pair, a frame is missing, a picture cannot be read, or the lenses are unknown or differ.
    LayoutError
        If the sizes differ.
    """
    pairs = find_pairs(first, second)
    compared = []
    with ProgressLine("compare") as line:
        for number, pair in enumerate(pairs):
            compared.append(_compare(pair, layout, linear=linear))
            if len(pairs) > 1:
                line.show((number + 1) / len(pairs), pair.name)
    return tuple(compared)


def notes_of(compared: Sequence[Comparison], *, linear: bool) -> tuple[str, ...]:
    """Return what the user should know about the compared files.

    Parameters
    ----------
    compared
        The comparisons.
    linear
        True if codes are read as linear light, whatever the files say.

    Raises
    ------
    ArtifactMissing, ArtifactBroken
        See `picture_notes`.
    """
    return picture_notes([path for one in compared for path in (one.pair.first, one.pair.second)], linear=linear)


def find_pairs(first: Path, second: Path) -> tuple[Pair, ...]:
    """Return the pairs of pictures to compare: two files, or the frames of two folders, by name.

    Parameters
    ----------
    first, second
        As in `compare_files`.
    """
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
    """Return the orthoscopic frames of a folder, or of its `orthoscopic/`, by name; an EXR is preferred to a PNG.

    Raises
    ------
    BadInput
        If there are none, or they are another kind of master.
    """
    inside = folder / ORTHOSCOPIC if (folder / ORTHOSCOPIC).is_dir() else folder
    # A later file replaces an earlier one of the same name: the master is read where there are both.
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


def _compare(pair: Pair, given: CellLayout | None, *, linear: bool) -> Comparison:
    layout = _layout(pair, given)
    with whole_picture(pair.first):
        first = picture_codes(pair.first, linear=linear)
    with whole_picture(pair.second):
        second = picture_codes(pair.second, linear=linear)
    with naming(pair.first, pair.second):
        return Comparison(pair, layout, compare(first, second), compare_views(first, second, layout))


def _layout(pair: Pair, given: CellLayout | None) -> CellLayout:
    """Return the lenses over both pictures; the headers and the options must agree on them."""
    found = {str(path): _layout_in(path) for path in (pair.first, pair.second)}
    known = {who: layout for who, layout in {**found, _OPTIONS: given}.items() if layout is not None}
    if not known:
        raise BadInput(
            f"expected {_OPTIONS}, or a master (EXR) whose header names its rig, got neither for {pair.first} and"
            f" {pair.second}"
        )
    if len(set(known.values())) > 1:
        listed = "; ".join(f"{layout} by {who}" for who, layout in known.items())
        raise BadInput(f"expected the same lenses over both, got {listed}")
    return next(iter(known.values()))


def _layout_in(path: Path) -> CellLayout | None:
    if path.suffix.lower() != MASTER:
        return None
    rig = rig_in(path)
    return None if rig is None else display_size(rig)
