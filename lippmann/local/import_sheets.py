"""Import integral images from elsewhere: find their lenses, then write masters like those of a job."""

from __future__ import annotations

import json
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from lippmann.errors import BadInput
from lippmann.job.imported_sheets import SUFFIXES, SheetGeometry
from lippmann.job.problems import problems_of
from lippmann.job.rig import Rig
from lippmann.lightfield.calibrate.calibrate import Calibration, calibrate_picture, calibrate_white_image
from lippmann.lightfield.calibrate.imported import orthoscopic_of
from lippmann.lightfield.sheet.device import device_size
from lippmann.lightfield.sheet.lens_grid import LensGrid, device_grid, layout_grid
from lippmann.lightfield.views.square_pixels import as_square
from lippmann.lightfield.views.views import centre, view, views_grid
from lippmann.local.files.master import naming, rig_in, whole_picture
from lippmann.local.files.writable import check_writable
from lippmann.plan import artifact_names as names
from lippmann.plan.imported import imported_rig, lens_grid, upright_first
from lippmann.plan.sampling import device_pixels, display_size, frame_size
from lippmann.terminal.progress import ProgressLine
from worker.images.colour_space import NOT_NAMED, colour_notes
from worker.images.write import write_exr, write_png, write_thumbnail
from worker.tasks.assemble import THUMB_PX
from worker.untrusted import read_imported

FITS = 0.002
"""The largest relative difference between a given pitch and the calibrated one: 0.2 lenses in a hundred."""


@dataclass(frozen=True)
class ImportOptions:
    """The known geometry of the lenses, and the pictures from which the rest is calibrated."""

    fields: Mapping[str, Any]
    """The given fields of `SheetGeometry`; the others are calibrated, or have their defaults."""
    white: Path | None = None
    """The white image from which the lenses are calibrated."""
    find: bool = False
    """True to calibrate the lenses from the first picture."""
    linear: bool = False
    """True to take the codes of the pictures for linear light, whatever their files say."""


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
    for path in files:
        _check_suffix(path)
    first = _read(files[0], options)
    lenses = find_lenses(files[0], first, options)
    check_writable(out)
    written: list[Path] = []
    with ProgressLine("import") as line:
        for place, path in enumerate(files):
            picture = first if place == 0 else _read(path, options)
            if picture.shape != first.shape:
                got = f"{picture.shape[0]} x {picture.shape[1]} px in {path}"
                raise BadInput(f"expected frames of {first.shape[0]} x {first.shape[1]} px as {files[0]}, got {got}")
            written += _write_frame(picture, lenses, path, frame=place + 1, out=out)
            line.show((place + 1) / len(files), path.name)
    notes = () if options.linear else tuple(map(_with_override, colour_notes(files)))
    return ImportResult(lenses=lenses, files=tuple(written), notes=(*lenses.notes, *notes))


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
        notes = _scale_notes(geometry) + (dropped if kept is not placed else ())
        by: Literal["said", "white", "picture"] = "said" if found is None else "white" if options.white else "picture"
        agreement = found.agreement if found else None
        return Lenses(geometry, kept, imported_rig(geometry, kept), by, agreement, notes)


def write_bundle(files: Sequence[Path], lenses: Lenses, folder: Path, *, title: str, linear: bool = False) -> None:
    """Write pictures and their geometry as a bundle, for a job that renders nothing.

    Parameters
    ----------
    files
        The pictures, in the order of the frames.
    lenses
        The lenses over every picture.
    folder
        The folder to write.
    title
        The title of the scene.
    linear
        True if the codes of the pictures are linear light, whatever their files say.

    Raises
    ------
    BadInput
        If the folder cannot be written.
    """
    check_writable(folder)
    frames = folder / "frames"
    frames.mkdir(exist_ok=True)
    # The frames are listed, so that files of an earlier import are not taken for frames.
    listed = [f"frames/{place + 1:04d}{path.suffix.lower()}" for place, path in enumerate(files)]
    for name, path in zip(listed, files, strict=True):
        shutil.copyfile(path, folder / name)
    # Numbers, texts, lists and booleans are written in TOML as in JSON.
    lines = (f"{name} = {json.dumps(value)}" for name, value in geometry_data(lenses).items())
    colour = ("linear = true",) if linear else ()
    text = (f"title = {json.dumps(title)}", "", "[sheets]", f"files = {json.dumps(listed)}", *lines, *colour, "")
    (folder / "scene.toml").write_text("\n".join(text))


def geometry_data(lenses: Lenses) -> dict[str, Any]:
    """Return the lenses as `--json` and a bundle name them, with every number."""
    grid, geometry = lenses.grid, lenses.geometry
    return {
        "pitch_px": round(grid.pitch_px, 6),
        "lattice": grid.lattice,
        "row_pitch_px": round(grid.row_px, 6),
        "rotation_deg": round(grid.turn_deg, 6),
        "offset_px": [round(at, 4) for at in grid.offset_px],
        "count": [grid.lens_rows, grid.lens_cols],
        "first_row_shifted": grid.first_row_shifted,
        "px_per_lens": lenses.rig.px_per_lens,
        "pseudoscopic": geometry.pseudoscopic,
        "inverted": geometry.inverted,
        "pitch_mm": lenses.rig.lens_array.pitch_mm,
        "focal_length_mm": lenses.rig.lens_array.focal_length_mm,
    }


def _of_master(path: Path, rig: Rig, picture: NDArray[np.float32], options: ImportOptions) -> Lenses:
    """Return the lenses of a master, whose header names everything."""
    kind, inverted = path.absolute().parent.name, rig.imaging_lens is not None
    if kind in ("views", "depth"):
        raise BadInput(f"expected an integral image, as {names.orthoscopic_name(1)}, got {path}")
    captured = kind == "integral"
    layout = frame_size(rig) if captured else display_size(rig)
    grid, size = layout_grid(layout), (layout.rows, layout.cols)
    if kind == "device" and rig.device is not None:
        pixels = device_pixels(rig.device, pitch_mm=rig.lens_array.pitch_mm)
        grid, size = device_grid(layout, **pixels), device_size(layout, **pixels)
    if picture.shape[:2] != size:
        got = f"{picture.shape[0]} x {picture.shape[1]} px"
        raise BadInput(f"{path}: expected {size[0]} x {size[1]} px for {layout}, as its header says, got {got}")
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
    if options.white is not None:
        white = _read(options.white, options)
        if white.shape != picture.shape:
            raise BadInput(
                f"expected a white image of {picture.shape[0]} x {picture.shape[1]} px as the picture, got"
                f" {white.shape[0]} x {white.shape[1]} px in {options.white}"
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


def _scale_notes(geometry: SheetGeometry) -> tuple[str, ...]:
    unknown = [
        option
        for option, value in (("--pitch-mm", geometry.pitch_mm), ("--focal-length-mm", geometry.focal_length_mm))
        if value is None
    ]
    if not unknown:
        return ()
    return (f"Depths in mm are right only if {' and '.join(unknown)} are given; the lens of the paper is assumed.",)


def _write_frame(picture: NDArray[np.float32], lenses: Lenses, source: Path, *, frame: int, out: Path) -> list[Path]:
    layout = lenses.grid.layout(lenses.rig.px_per_lens)
    sense = {"pseudoscopic": lenses.geometry.pseudoscopic, "inverted": lenses.geometry.inverted}
    shown = orthoscopic_of(picture, lenses.grid, layout, **sense)
    display = display_size(lenses.rig)
    attributes = {"rig": lenses.rig.model_dump_json(), "frame": str(frame), "source": source.name}
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


def _check_suffix(path: Path) -> None:
    if path.suffix.lower() not in SUFFIXES:
        raise BadInput(f"expected a picture as {', '.join(SUFFIXES)}, got {path}")
    if not path.is_file():
        raise BadInput(f"expected a picture at {path}, got no file")


def _read(path: Path, options: ImportOptions) -> NDArray[np.float32]:
    _check_suffix(path)
    with whole_picture(path):
        return read_imported(path, linear=options.linear)


def _with_override(note: str) -> str:
    return f"{note} If they are linear light, give --linear." if NOT_NAMED in note else note
