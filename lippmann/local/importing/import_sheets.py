"""Import integral images from elsewhere: find their lenses, then write masters like those of a job."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from lippmann.errors import BadInput
from lippmann.job.fields.problems import problems_of
from lippmann.job.optics.rig import Rig
from lippmann.job.scenes.imported_sheets import SheetGeometry
from lippmann.lightfield.calibrate.calibrate import Calibration, calibrate_picture, calibrate_white_image
from lippmann.lightfield.calibrate.flat_field import divided_by_white
from lippmann.lightfield.calibrate.imported import orthoscopic_of
from lippmann.lightfield.sheet.device import device_size
from lippmann.lightfield.sheet.lens_grid import LensGrid, device_grid, layout_grid
from lippmann.lightfield.views.square_pixels import as_square
from lippmann.lightfield.views.views import centre, view, views_grid
from lippmann.local.files.master import naming, rig_in
from lippmann.local.files.source_pictures import (
    Decoding,
    SourcePicture,
    not_finite_notes,
    page_notes,
    read_picture,
    source_pictures,
    unused_bits_note,
    upright_size,
)
from lippmann.local.files.writable import check_writable
from lippmann.plan import artifact_names as names
from lippmann.plan.imported import imported_rig, lens_grid, upright_first
from lippmann.plan.sampling import device_pixels, display_size, frame_size
from lippmann.terminal.progress import ProgressLine
from worker.images.foreign.colour_space import NOT_NAMED
from worker.images.foreign.notes import picture_notes
from worker.images.read import Light
from worker.images.write import write_exr, write_png, write_thumbnail
from worker.tasks.frames.assemble import THUMB_PX

FITS = 0.002
"""The largest relative difference between a given pitch and the calibrated one: 0.2 lenses in a hundred."""


@dataclass(frozen=True)
class ImportOptions:
    """The known geometry of the lenses, and the pictures from which the rest is calibrated."""

    fields: Mapping[str, Any]
    """The given fields of `SheetGeometry`; the others are calibrated, or have their defaults."""
    find_from: Path | None = None
    """The white image from which the lenses are calibrated."""
    find: bool = False
    """True to calibrate the lenses from the first picture."""
    decoding: Decoding = Decoding()  # noqa: RUF009 - it is frozen
    """The way in which the numbers of the pictures become light."""
    white: Path | None = None
    """The white image by which the pictures are divided."""


@dataclass(frozen=True)
class Lenses:
    """The lenses over every picture, and the source of that knowledge."""

    geometry: SheetGeometry
    grid: LensGrid
    rig: Rig
    known_by: Literal["said", "white", "picture", "header"]
    agreement: float | None
    """The agreement of the calibration with the picture, 0 to 1."""
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class ImportResult:
    """The files of an import."""

    lenses: Lenses
    files: tuple[Path, ...]
    notes: tuple[str, ...] = ()
    """Notes for the user about the lenses and the colour spaces."""


def import_sheets(files: Sequence[Path], options: ImportOptions, *, out: Path) -> ImportResult:
    """Import pictures as frames 1, 2, .. and write their masters into a folder.

    Parameters
    ----------
    files
        The pictures, in the order of the frames.
    options
        What is known of their lenses.
    out
        The folder to write.

    Raises
    ------
    BadInput
        If a picture is not there or not whole, the lenses are not known, or do not fit.
    """
    sources = source_pictures(files)
    _check_sizes(sources)
    stored = read_picture(sources[0], options.decoding)
    unused_bits = unused_bits_note(sources[0], stored, options.decoding)
    white = None if options.white is None else read_picture(SourcePicture(options.white), options.decoding)
    first = _divided(stored, white, options)
    lenses = find_lenses(files[0], first, options)
    check_writable(out)
    written: list[Path] = []
    odd: list[str] = []
    with ProgressLine("import") as line:
        for place, source in enumerate(sources):
            picture = first if place == 0 else _divided(read_picture(source, options.decoding), white, options)
            odd += not_finite_notes(source, picture)
            written += write_frame(picture, lenses, source.name, frame=place + 1, out=out)
            line.show((place + 1) / len(sources), source.name)
    read = picture_notes(files, linear=options.decoding.linear)
    notes = (*lenses.notes, *page_notes(sources), *map(_with_override, read), *filter(None, [unused_bits]), *odd)
    return ImportResult(lenses=lenses, files=tuple(written), notes=notes)


def _check_sizes(sources: Sequence[SourcePicture]) -> None:
    """Refuse frames of different sizes by their headers, before one of them is decoded."""
    rows, cols = upright_size(sources[0])
    for source in sources[1:]:
        size = upright_size(source)
        if size != (rows, cols):
            hint = "" if source.page is None else "; save the pages to import in a file of their own"
            raise BadInput(
                f"expected frames of {cols} x {rows} px as {sources[0]}, got {size[1]} x {size[0]} px in {source}{hint}"
            )


def _divided(
    picture: NDArray[np.float32], white: NDArray[np.float32] | None, options: ImportOptions
) -> NDArray[np.float32]:
    if white is None or options.white is None:
        return picture
    with naming(options.white):
        return divided_by_white(picture, white)


def find_lenses(path: Path, picture: NDArray[np.float32], options: ImportOptions) -> Lenses:
    """Return the lenses over a picture, as its header names them, as calibrated, or as given; all must agree.

    Parameters
    ----------
    path
        The file of the picture.
    picture
        `(rows, cols, 3)`, linear light.
    options
        What is known of the lenses.

    Raises
    ------
    BadInput
        If nothing gives the pitch, or a given value does not agree with the calibration.
    LayoutError
        If the lenses do not lie on the picture.
    """
    rig = rig_in(path) if path.suffix.lower() == ".exr" else None
    with naming(path):
        if rig is not None and not options.fields.get("pitch_px"):
            return _of_master(path, rig, picture, options)
        found = _found(picture, options)
        if found is None and options.fields.get("pitch_px") is None:
            raise BadInput("expected --pitch-px, or --find, or --find-from with a white image, got none of them")
        geometry = _geometry(options.fields, found)
        if found is not None:
            _check_fit(options.fields, found)
        placed = lens_grid(geometry, picture.shape[:2])
        kept = upright_first(placed, inverted=geometry.inverted)
        dropped = ("The first lens row is left out, as a sheet begins with one that is not shifted.",)
        notes = scale_notes(geometry) + (dropped if kept is not placed else ())
        by: Literal["said", "white", "picture"] = (
            "said" if found is None else "white" if options.find_from else "picture"
        )
        agreement = found.agreement if found else None
        return Lenses(geometry, kept, imported_rig(geometry, kept), by, agreement, notes)


def _of_master(path: Path, rig: Rig, picture: NDArray[np.float32], options: ImportOptions) -> Lenses:
    """Return the lenses of a master, whose header names everything."""
    kind, inverted = path.absolute().parent.name, rig.imaging_lens is not None
    if kind in ("views", "depth", "channels"):
        raise BadInput(f"expected an integral image, as {names.orthoscopic_name(1)}, got {path}")
    captured = kind == "integral"
    layout = frame_size(rig) if captured else display_size(rig)
    grid, size = layout_grid(layout), (layout.rows, layout.cols)
    if kind == "device" and rig.device is not None:
        pixels = device_pixels(rig.device, pitch_mm=rig.lens_array.pitch_mm)
        grid, size = device_grid(layout, **pixels), device_size(layout, **pixels)
    if picture.shape[:2] != size:
        got = f"{picture.shape[1]} x {picture.shape[0]} px"
        raise BadInput(f"{path}: expected {size[1]} x {size[0]} px for {layout}, as its header says, got {got}")
    turned = {"pseudoscopic": captured, "inverted": captured and inverted}
    geometry = SheetGeometry(
        pitch_px=grid.pitch_px, lattice=grid.lattice, row_pitch_px=grid.row_px, offset_px=grid.offset_px,
        count=(grid.lens_rows, grid.lens_cols), first_row_shifted=grid.first_row_shifted, px_per_lens=rig.px_per_lens,
        pitch_mm=rig.lens_array.pitch_mm, focal_length_mm=rig.lens_array.focal_length_mm,
        **(turned | {name: bool(value) for name, value in options.fields.items() if name in turned}),
    )  # fmt: skip
    kept = upright_first(grid, inverted=geometry.inverted)
    return Lenses(geometry, kept, imported_rig(geometry, kept), "header", None)


def _found(picture: NDArray[np.float32], options: ImportOptions) -> Calibration | None:
    if options.find_from is not None:
        white = read_picture(SourcePicture(options.find_from), options.decoding)
        if white.shape != picture.shape:
            raise BadInput(
                f"expected a white image of {picture.shape[1]} x {picture.shape[0]} px as the picture, got"
                f" {white.shape[1]} x {white.shape[0]} px in {options.find_from}"
            )
        return calibrate_white_image(white)
    return calibrate_picture(picture, near_px=options.fields.get("pitch_px")) if options.find else None


def _geometry(fields: Mapping[str, Any], found: Calibration | None) -> SheetGeometry:
    known: dict[str, Any] = {}
    if found is not None:
        grid = found.grid
        known = {
            "lattice": grid.lattice, "row_pitch_px": grid.row_px, "rotation_deg": grid.turn_deg,
            "offset_px": grid.offset_px, "first_row_shifted": grid.first_row_shifted,
        }  # fmt: skip
        if "offset_px" not in fields:
            known["count"] = (grid.lens_rows, grid.lens_cols)
    # A calibrated pitch is more exact than a given one, once the two agree.
    pitch = {"pitch_px": found.grid.pitch_px} if found is not None else {}
    try:
        return SheetGeometry.model_validate(known | dict(fields) | pitch)
    except ValidationError as error:
        raise BadInput("; ".join(map(str, problems_of(error)))) from error


def _check_fit(fields: Mapping[str, Any], found: Calibration) -> None:
    """Refuse given values that do not agree with the calibration; the message names the one that fits."""
    pitch, grid = fields.get("pitch_px"), found.grid
    if pitch is not None and abs(pitch / grid.pitch_px - 1) > FITS:
        raise BadInput(f"expected --pitch-px {grid.pitch_px:.4f}, which fits the picture, got {pitch:g}")
    if fields.get("lattice", grid.lattice) != grid.lattice:
        raise BadInput(f"expected --lattice {grid.lattice}, which fits the picture, got {fields['lattice']}")


def scale_notes(geometry: SheetGeometry) -> tuple[str, ...]:
    """Return a note if lengths in mm are assumed."""
    unknown = [
        option
        for option, value in (("--pitch-mm", geometry.pitch_mm), ("--focal-length-mm", geometry.focal_length_mm))
        if value is None
    ]
    if not unknown:
        return ()
    return (f"Depths in mm are right only if {' and '.join(unknown)} are given; the lens of the paper is assumed.",)


def write_frame(picture: NDArray[Light], lenses: Lenses, source: str, *, frame: int, out: Path) -> list[Path]:
    """Write the masters of a picture, and return their paths.

    Parameters
    ----------
    picture
        `(rows, cols, 3)`, linear light.
    lenses
        The lenses over it.
    source
        The name of the picture, for the headers of the masters.
    frame
        The number of the frame.
    out
        The folder to write.
    """
    layout = lenses.grid.layout(lenses.rig.px_per_lens)
    sense = {"pseudoscopic": lenses.geometry.pseudoscopic, "inverted": lenses.geometry.inverted}
    shown = orthoscopic_of(picture, lenses.grid, layout, **sense)
    display = display_size(lenses.rig)
    attributes = {"rig": lenses.rig.model_dump_json(), "frame": str(frame), "source": source}
    written = []
    for name, pixels in ((names.orthoscopic_name(frame), shown), (names.views_name(frame), views_grid(shown, display))):
        path = out / name
        path.parent.mkdir(parents=True, exist_ok=True)
        write_exr(path, pixels, attributes=attributes)
        write_png(path.with_suffix(".png"), pixels)
        written += [path, path.with_suffix(".png")]
    thumb = out / names.thumb_name(frame)
    thumb.parent.mkdir(parents=True, exist_ok=True)
    write_thumbnail(thumb, as_square(view(shown, display, *centre(display)), display), longest_px=THUMB_PX)
    return [*written, thumb]


def _with_override(note: str) -> str:
    return f"{note} If they are linear light, give --linear." if NOT_NAMED in note else note
