"""Import the views of other programs, and those that Lippmann exports: quilts, and folders with a file for every view.

The pixels of all views at one place are the pixels under one lens. So views become an integral image without
resampling, and its views are the same again.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import BadInput
from lippmann.job.imported_sheets import SheetGeometry
from lippmann.job.rig import MIN_PX_PER_LENS
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.sheet.lens_grid import layout_grid
from lippmann.lightfield.views.views import interlace
from lippmann.local.files.source_pictures import Decoding, SourcePicture, read_picture
from lippmann.local.files.view_files import NameOrder, Parallax, quilt_name, view_files
from lippmann.local.files.writable import check_writable
from lippmann.local.import_sheets import ImportResult, Lenses, scale_notes, write_frame
from lippmann.plan.imported import imported_rig
from lippmann.terminal.progress import ProgressLine
from worker.images.notes import picture_notes
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
    first, notes = _views(sources[0], options)
    lenses = _lenses(first, options)
    check_writable(out)
    written: list[Path] = []
    with ProgressLine("import") as line:
        for place, source in enumerate(sources):
            views = first if place == 0 else _views(source, options)[0]
            if views.shape != first.shape:
                raise BadInput(f"expected views {_size(first)} as in {sources[0]}, got {_size(views)} in {source}")
            sheet = _sheet(views, lenses.grid.layout())
            written += write_frame(sheet, lenses, source.name, frame=place + 1, out=out)
            line.show((place + 1) / len(sources), source.name)
    return ImportResult(lenses=lenses, files=tuple(written), notes=(*lenses.notes, *notes))


def _views(source: Path, options: ViewsOptions) -> tuple[Views, tuple[str, ...]]:
    """Return views `(v, u, lens_row, lens_col, channel)`, as many down as across, and notes."""
    views, files, notes = _of_folder(source, options) if source.is_dir() else _of_quilt(source, options)
    if options.pseudoscopic:
        views = views[::-1, ::-1]
    chosen = _chosen(views, options.px_per_lens)
    _check_size(chosen, source)
    return chosen, (*notes, *picture_notes(files, linear=options.decoding.linear))


def _of_quilt(path: Path, options: ViewsOptions) -> tuple[Views, list[Path], tuple[str, ...]]:
    said = quilt_name(path)
    picture = read_picture(SourcePicture(path), options.decoding)
    rows, cols = picture.shape[:2]
    if rows % said.rows or cols % said.columns:
        raise BadInput(
            f"expected a quilt that {said.columns} x {said.rows} tiles (columns x rows) divide, got {cols} x {rows} px"
            f" (width x height) in {path}"
        )
    high, wide = rows // said.rows, cols // said.columns
    tiles = picture.reshape(said.rows, high, said.columns, wide, 3).swapaxes(1, 2)
    # Tiles go from the lower left to the right, then up: in a row of views from the leftmost to the rightmost, in a
    # grid the lowest row of views first.
    views = tiles if options.parallax == "grid" else tiles[::-1].reshape(1, -1, high, wide, 3)
    notes: tuple[str, ...] = ()
    if abs(said.aspect * high / wide - 1) > SAME_ASPECT:
        notes = (
            f"{path.name}: its views are shown with an aspect of {said.aspect:g}, but have {wide} x {high} px; lenses"
            " are taken to be square.",
        )
    return views, [path], notes


def _of_folder(folder: Path, options: ViewsOptions) -> tuple[Views, list[Path], tuple[str, ...]]:
    found = view_files(folder, options.parallax, order=options.order)
    views: Views | None = None
    for place, path in found.files.items():
        picture = read_picture(SourcePicture(path), options.decoding)
        if views is None:
            views = np.empty((found.rows, found.cols, *picture.shape), dtype=np.float32)
        if picture.shape != views.shape[2:]:
            got = f"{picture.shape[1]} x {picture.shape[0]} px"
            raise BadInput(f"expected views of {views.shape[3]} x {views.shape[2]} px in {folder}, got {got} in {path}")
        views[place] = picture
    assert views is not None  # noqa: S101 - `view_files` never returns none
    return views, list(found.files.values()), ()


def _chosen(views: Views, count: int | None) -> Views:
    """Return as many views down as across: some of them, or one row of views again and again."""
    down, across = views.shape[:2]
    if down not in (1, across):
        raise BadInput(f"expected as many rows of views as columns, or one row, got {down} rows of {across}")
    if count is not None and count > across:
        raise BadInput(f"expected --px-per-lens of at most {across}, the number of views in a row, got {count}")
    if (count or across) < MIN_PX_PER_LENS:
        raise BadInput(f"expected at least {MIN_PX_PER_LENS} views in a row, got {count or across}")
    taken = np.rint(np.linspace(0, across - 1, count or across)).astype(int)
    if down == 1:
        return np.broadcast_to(views[:, taken], (len(taken), len(taken), *views.shape[2:]))
    chosen: Views = views[taken[:, np.newaxis], taken]
    return chosen


def _check_size(views: Views, source: Path) -> None:
    """Refuse an integral image that is larger than pictures may be; the message names a number of views that fits."""
    count, most, lenses = views.shape[0], WorkerSettings().picture_px, views.shape[2] * views.shape[3]
    if count * count * lenses > most:
        fits = int((most / lenses) ** 0.5)
        raise BadInput(
            f"expected an integral image of at most {most} px, got {count} x {count} views {_size(views)} in {source};"
            f" give --px-per-lens {fits} for as many of the views"
        )


def _sheet(views: Views, layout: CellLayout) -> NDArray[np.float16]:
    """Return the integral image of views in half floats, as masters have them."""
    vs, us, lens_rows, lens_cols, channels = views.shape
    grid = views.transpose(0, 2, 1, 3, 4).astype(np.float16).reshape(vs * lens_rows, us * lens_cols, channels)
    return interlace(grid, layout)


def _lenses(views: Views, options: ViewsOptions) -> Lenses:
    count, lens_rows, lens_cols = views.shape[1:4]
    layout = CellLayout(lens_rows, lens_cols, count)
    grid = layout_grid(layout)
    geometry = SheetGeometry(
        pitch_px=count, row_pitch_px=grid.row_px, offset_px=grid.offset_px, count=(lens_rows, lens_cols),
        px_per_lens=count, pitch_mm=options.pitch_mm, focal_length_mm=options.focal_length_mm,
    )  # fmt: skip
    return Lenses(geometry, grid, imported_rig(geometry, grid), "said", None, scale_notes(geometry))


def _size(views: Views) -> str:
    return f"of {views.shape[3]} x {views.shape[2]} px"
