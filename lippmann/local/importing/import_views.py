"""Import the views of other programs, and those that Lippmann exports: quilts, and folders with a file for every view.

The pixels of all views at one place are the pixels under one lens. So views become an integral image without
resampling, and its views are the same again.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from lippmann.errors import BadInput
from lippmann.job.fields.problems import problems_of
from lippmann.job.optics.rig import MIN_PX_PER_LENS
from lippmann.job.scenes.imported_sheets import SheetGeometry
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.sheet.lens_grid import layout_grid
from lippmann.lightfield.views.views import interlace
from lippmann.local.files.source_pictures import Decoding, SourcePicture, read_picture, upright_size
from lippmann.local.files.view_files import NameOrder, Parallax, quilt_name, view_files
from lippmann.local.files.writable import check_writable
from lippmann.local.importing.import_sheets import ImportResult, Lenses, scale_notes, write_frame
from lippmann.plan.imported import imported_rig
from lippmann.terminal.progress import ProgressLine
from worker.images.foreign.notes import picture_notes
from worker.settings import WorkerSettings

SAME_ASPECT = 0.02
"""The relative difference of the aspect in a quilt's name from that of its tiles up to which pixels are square."""

Views = NDArray[np.float32]


@dataclass(frozen=True)
class ViewsOptions:
    """The options for views that their files do not name themselves."""

    parallax: Parallax
    """`row` or `grid` of views."""
    order: NameOrder | None = None
    """The meaning of two numbers in the names of files."""
    px_per_lens: int | None = None
    """The number of views in a row that are used, evenly spaced; by default all."""
    pseudoscopic: bool = False
    """True if the first view is the rightmost, and that of the lowest row."""
    pitch_mm: float | None = None
    focal_length_mm: float | None = None
    decoding: Decoding = Decoding()  # noqa: RUF009 - it is frozen
    """The way in which the numbers of the pictures become light."""


def import_views(sources: Sequence[Path], options: ViewsOptions, *, out: Path) -> ImportResult:
    """Import views as frames 1, 2, .. and write their masters into a folder.

    Every header is checked before a picture is decoded; then the views of one frame are in memory at a time.

    Parameters
    ----------
    sources
        Quilts, or folders of views, in the order of the frames.
    options
        What they do not say themselves.
    out
        The folder to write.

    Raises
    ------
    BadInput
        If views are missing, damaged, or of different sizes, or their integral image would be too large.
    """
    frames = [_found(source, options) for source in sources]
    first = frames[0]
    for frame in frames:
        if (frame.count, frame.size) != (first.count, first.size):
            raise BadInput(f"expected {first} as in {first.source}, got {frame} in {frame.source}")
    lenses = _lenses(first, options)
    check_writable(out)
    written: list[Path] = []
    with ProgressLine("import") as line:
        for place, frame in enumerate(frames):
            sheet = _sheet(frame.views(options.decoding), lenses.grid.layout())
            written += write_frame(sheet, lenses, frame.source.name, frame=place + 1, out=out)
            line.show((place + 1) / len(frames), frame.source.name)
    notes = (*first.notes, *picture_notes(first.files, linear=options.decoding.linear))
    return ImportResult(lenses=lenses, files=tuple(written), notes=(*lenses.notes, *notes))


@dataclass(frozen=True)
class _Frame:
    """The views of a frame by their headers: nothing is decoded yet."""

    source: Path
    down: tuple[int, ...]
    """The rows of the views that are used, from the uppermost; one alone is used again and again."""
    across: tuple[int, ...]
    """The columns of the views that are used, from the leftmost; there are as many views down."""
    size: tuple[int, int]
    """The (rows, cols) of a view, px."""
    files: tuple[Path, ...]
    """The files that are read."""
    read: Callable[[Decoding], Iterator[tuple[int, int, Views]]]
    """Reads the views that are used, each with its number down and across among those."""
    notes: tuple[str, ...] = ()

    @property
    def count(self) -> int:
        """The number of views in a row of the integral image."""
        return len(self.across)

    def __str__(self) -> str:
        """Return the number of the views and their size, both as width x height."""
        return f"{self.count} x {self.count} views of {self.size[1]} x {self.size[0]} px"

    def views(self, decoding: Decoding) -> Views:
        """Decode the views, `(v, u, lens_row, lens_col, channel)`, as many down as across."""
        views = np.empty((len(self.down), self.count, *self.size, 3), dtype=np.float32)
        for v, u, view in self.read(decoding):
            views[v, u] = view
        return np.broadcast_to(views, (self.count, *views.shape[1:]))


def _found(source: Path, options: ViewsOptions) -> _Frame:
    """Return the views of a quilt or a folder, if their integral image is not too large."""
    frame = _of_folder(source, options) if source.is_dir() else _of_quilt(source, options)
    most, lenses = WorkerSettings().picture_px, math.prod(frame.size)
    px = frame.count**2 * lenses
    if px > most:
        raise BadInput(
            f"expected an integral image of at most {most} px, got {px} px of {frame} in {source}; give --px-per-lens"
            f" {math.isqrt(most // lenses)} for as many of the views"
        )
    return frame


def _of_quilt(path: Path, options: ViewsOptions) -> _Frame:
    said = quilt_name(path)
    rows, cols = upright_size(SourcePicture(path))
    if rows % said.rows or cols % said.columns:
        raise BadInput(
            f"expected a quilt that {said.columns} x {said.rows} tiles (columns x rows) divide, got {cols} x {rows} px"
            f" (width x height) in {path}"
        )
    high, wide = rows // said.rows, cols // said.columns
    is_grid = options.parallax == "grid"
    count = (said.rows, said.columns) if is_grid else (1, said.rows * said.columns)
    down, across = _used(count, options)

    def read(decoding: Decoding) -> Iterator[tuple[int, int, Views]]:
        picture = read_picture(SourcePicture(path), decoding)
        for (v, row), (u, col) in product(enumerate(down), enumerate(across)):
            # Tiles go from the lower left to the right, then up: in a row of views from the leftmost to the rightmost,
            # in a grid the lowest row of views first.
            tile_row, tile_col = (row, col) if is_grid else (said.rows - 1 - col // said.columns, col % said.columns)
            yield v, u, picture[tile_row * high :, tile_col * wide :][:high, :wide]

    notes: tuple[str, ...] = ()
    if said.aspect is not None and abs(said.aspect * high / wide - 1) > SAME_ASPECT:
        notes = (
            f"{path.name}: its views are shown with an aspect of {said.aspect:g}, but have {wide} x {high} px; lenses"
            " are taken to be square.",
        )
    return _Frame(path, down, across, (high, wide), (path,), read, notes)


def _of_folder(folder: Path, options: ViewsOptions) -> _Frame:
    found = view_files(folder, options.parallax, order=options.order)
    down, across = _used((found.rows, found.cols), options)
    used = {(v, u): found.files[row, col] for (v, row), (u, col) in product(enumerate(down), enumerate(across))}
    sizes = {path: upright_size(SourcePicture(path)) for path in used.values()}
    size = next(iter(sizes.values()))
    for path, (rows, cols) in sizes.items():
        if (rows, cols) != size:
            raise BadInput(f"expected views of {size[1]} x {size[0]} px in {folder}, got {cols} x {rows} px in {path}")

    def read(decoding: Decoding) -> Iterator[tuple[int, int, Views]]:
        for (v, u), path in used.items():
            yield v, u, read_picture(SourcePicture(path), decoding)

    notes = () if found.note is None else (found.note,)
    return _Frame(folder, down, across, size, tuple(used.values()), read, notes)


def _used(count: tuple[int, int], options: ViewsOptions) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Return which rows and columns of views are used: as many, or one row."""
    down, across = count
    if down not in (1, across):
        raise BadInput(f"expected as many rows of views as columns, or one row, got {down} rows of {across}")
    wanted = options.px_per_lens
    if wanted is not None and wanted > across:
        raise BadInput(f"expected --px-per-lens of at most {across}, the number of views in a row, got {wanted}")
    if (wanted or across) < MIN_PX_PER_LENS:
        raise BadInput(f"expected at least {MIN_PX_PER_LENS} views in a row, got {wanted or across}")
    taken = np.rint(np.linspace(0, across - 1, wanted or across)).astype(int)
    used = tuple(int(across - 1 - place if options.pseudoscopic else place) for place in taken)
    return ((0,) if down == 1 else used), used


def _sheet(views: Views, layout: CellLayout) -> NDArray[np.float16]:
    """Return the integral image of views in half floats, as masters have them."""
    vs, us, lens_rows, lens_cols, channels = views.shape
    grid = views.transpose(0, 2, 1, 3, 4).astype(np.float16).reshape(vs * lens_rows, us * lens_cols, channels)
    return interlace(grid, layout)


def _lenses(frame: _Frame, options: ViewsOptions) -> Lenses:
    count, (lens_rows, lens_cols) = frame.count, frame.size
    layout = CellLayout(lens_rows, lens_cols, count)
    grid = layout_grid(layout)
    try:
        geometry = SheetGeometry(
            pitch_px=count, row_pitch_px=grid.row_px, offset_px=grid.offset_px, count=(lens_rows, lens_cols),
            px_per_lens=count, pitch_mm=options.pitch_mm, focal_length_mm=options.focal_length_mm,
        )  # fmt: skip
    except ValidationError as error:
        raise BadInput(f"{frame.source}: {'; '.join(map(str, problems_of(error)))}") from error
    return Lenses(geometry, grid, imported_rig(geometry, grid), "said", None, scale_notes(geometry))
