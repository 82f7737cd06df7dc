"""Convert a pseudoscopic integral image on disk, in bands: by the half-turn, or for another display by SPOC."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from lippmann.errors import BadInput
from lippmann.job.fields.problems import FieldError, problems_of
from lippmann.job.optics.rig import Rig
from lippmann.job.outputs.spoc import Spoc
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.sheet.bands import OrthoscopicSheet, Sheet, SheetOfRows, TurnedSheet, stitched
from lippmann.local.files.master import naming, rig_in, whole_picture
from lippmann.local.files.writable import check_writable
from lippmann.plan import artifact_names as names
from lippmann.plan.sampling import display_size, frame_size
from lippmann.terminal.progress import ProgressLine
from worker.images.bands.rows import BAND_PX
from worker.images.bands.scratch import ScratchRows
from worker.images.colour import linear_light, srgb_codes
from worker.images.foreign.colour_space import ColourSpace, file_colour_space, light_of_codes, linear_space
from worker.images.foreign.header import read_header
from worker.images.foreign.notes import picture_notes
from worker.images.headers.picture import UPRIGHT
from worker.images.read import read_attributes
from worker.images.write import write_code_rows, write_exr_rows
from worker.tasks.outputs.pictures import sheet_density
from worker.tasks.outputs.spoc import spoc_sheet
from worker.untrusted import decoded_rows

MASTER = ".exr"
PICTURES = (".png", ".tif", ".tiff")
NOT_CAPTURED = ("orthoscopic", "views", "device", "depth", "channels")
"""The folders of masters that are no captures although their headers name the same rig."""


@dataclass(frozen=True)
class CaptureOptions:
    """The properties of a capture that the options give if no header does."""

    layout: CellLayout | None = None
    pitch_mm: float | None = None
    gap_mm: float | None = None
    turn_sheet: bool | None = None
    """True if an imaging lens turned the picture upside down."""


@dataclass(frozen=True)
class Conversion:
    """The file of a conversion, and its lenses."""

    file: Path
    method: str
    """`half-turn` or `spoc`."""
    captured: CellLayout
    layout: CellLayout
    sheet_turned: bool
    notes: tuple[str, ...] = ()
    """Notes for the user about the colour space of the file."""


def write_orthoscopic(
    file: Path,
    out: Path,
    *,
    capture: CaptureOptions,
    display: Spoc | None,
    bits: int | None = None,
    linear: bool = False,
) -> Conversion:
    """Write the orthoscopic integral image of a pseudoscopic one.

    Parameters
    ----------
    file
        EXR, PNG or TIFF; the header of a master names its lenses.
    out
        EXR for linear light, or PNG or TIFF for sRGB codes; the file appears when it is whole.
    capture
        What the header does not name; what both name must agree.
    display
        Another display than that of the capture, for SPOC; its `name` and `bits` are ignored.
    bits
        The bits of codes made from linear light; existing codes keep theirs.
    linear
        True to take the codes of a PNG or TIFF for linear light, whatever the file says.

    Raises
    ------
    BadInput
        If there is no such picture, it is no capture or damaged, its lenses are unknown, or the display cannot be.
    LayoutError
        If the pixels do not divide among the lenses.
    OutputError, DiskFull, DiskUnavailable
        If it cannot be written.
    """
    _check_files(file, out)
    rig = rig_in(file) if file.suffix.lower() == MASTER else None
    layout = _layout(file, rig, capture)
    known = _known_rig(rig, layout, capture, display)
    turn = capture.turn_sheet if capture.turn_sheet is not None else rig is not None and rig.imaging_lens is not None
    _check_header(file)
    with naming(file), whole_picture(file), _opened(file, out.parent) as picture:
        made = _made(SheetOfRows(picture, layout), turn, known, display)
        space = linear_space(None) if linear else file_colour_space(file)
        shown = known if known is None or display is None else display.display(known)
        header = _header(file, made, shown)
        _write(out, made, picture.dtype, space=space, header=header, bits=bits, shown=shown)
    method = "half-turn" if display is None else "spoc"
    notes = picture_notes([file], linear=linear)
    return Conversion(
        file=out, method=method, captured=layout, layout=made.layout, sheet_turned=turn, notes=notes
    )  # fmt: skip


def display_of(options: Mapping[str, Any]) -> Spoc | None:
    """Return the display that options describe by the fields of `Spoc`; None if they are all None.

    Raises
    ------
    BadInput
        If an option cannot be; the message names it.
    """
    fields = {field: value for field, value in options.items() if value is not None}
    try:
        return Spoc.model_validate(fields) if fields else None
    except ValidationError as error:
        problem = problems_of(error)[0]
        field = problem.field.partition(".")[0]
        raise BadInput(f"{option_of(field)}: expected {problem.expected}, got {problem.got}") from error


def option_of(field: str) -> str:
    """Return the option of a field of a display.

    >>> option_of("pitch_mm"), option_of("reference_mm"), option_of("count")
    ('--display-pitch-mm', '--reference-mm', '--display-lenses')
    """
    if field == "count":
        return "--display-lenses"
    is_depth = field in ("distance_mm", "reference_mm")
    return f"--{'' if is_depth else 'display-'}{field.replace('_', '-')}"


def _check_files(file: Path, out: Path) -> None:
    for path, option in ((file, "FILE"), (out, "--out")):
        if path.suffix.lower() not in (MASTER, *PICTURES):
            raise BadInput(f"expected an EXR, a PNG or a TIFF as {option}, got {path}")
    if not file.is_file():
        raise BadInput(f"expected a pseudoscopic integral image, got {file}: there is no such file")
    if file.absolute().parent.name in NOT_CAPTURED:
        raise BadInput(f"expected a sheet as captured, as integral/{file.name}, got {file}")
    if out.exists() and out.samefile(file):
        raise BadInput(f"expected another file in --out than the sheet itself, got {out}")
    check_writable(out.parent)


def _check_header(file: Path) -> None:
    """Refuse a picture that is not one upright one, which bands of rows cannot be made of."""
    with whole_picture(file):
        header = read_header(file)
    if header.orientation != UPRIGHT:
        raise BadInput(f"expected a picture that is stored upright, got the orientation {header.orientation} in {file}")
    if len(header.pages) > 1:
        raise BadInput(f"expected one picture, got {len(header.pages)} pages in {file}")


def _layout(file: Path, rig: Rig | None, capture: CaptureOptions) -> CellLayout:
    found = None if rig is None else frame_size(rig)
    if found is not None and capture.layout is not None and found != capture.layout:
        raise BadInput(f"expected the lenses that the header of {file} names, {found}, got {capture.layout}")
    layout = found or capture.layout
    if layout is None:
        raise BadInput(
            f"expected --px-per-lens and --lenses, or a master (EXR) whose header names its rig, got neither for {file}"
        )
    return layout


def _known_rig(rig: Rig | None, layout: CellLayout, capture: CaptureOptions, display: Spoc | None) -> Rig | None:
    """Return the rig of the header, or one of direct pickup with the pitch and gap of the options."""
    lengths = {"--pitch-mm": capture.pitch_mm, "--gap-mm": capture.gap_mm}
    given = [option for option, length_mm in lengths.items() if length_mm is not None]
    if rig is not None and given:
        raise BadInput(f"expected no {' and '.join(given)}: the header names pitch and focal length")
    for option, length_mm in lengths.items():
        if length_mm is not None and not 0 < length_mm < math.inf:
            raise BadInput(f"expected a positive number of mm in {option}, got {length_mm:g}")
    if display is not None and rig is None and (len(given) < 2 or display.reference_mm is None):
        raise BadInput(
            "expected --pitch-mm and --gap-mm of the capture and --reference-mm for another display, or a master (EXR)"
            " whose header names its rig"
        )
    return rig or (_direct(layout, capture) if len(given) == 2 else None)


def _direct(layout: CellLayout, capture: CaptureOptions) -> Rig:
    array = {
        "lattice": layout.lattice,
        "count": [layout.lens_rows, layout.lens_cols],
        "pitch_mm": capture.pitch_mm,
        "focal_length_mm": capture.gap_mm,
    }
    try:
        return Rig.model_validate({"imaging_lens": None, "px_per_lens": layout.px_per_lens, "lens_array": array})
    except ValidationError as error:
        problem = problems_of(error)[0]
        raise BadInput(f"{problem.field}: expected {problem.expected}, got {problem.got}") from error


def _made(captured: Sheet, turn: bool, rig: Rig | None, display: Spoc | None) -> Sheet:
    if display is None or rig is None:
        return OrthoscopicSheet(captured, inverted=turn)
    try:
        return spoc_sheet(TurnedSheet(captured) if turn else captured, rig, display)
    except FieldError as error:
        raise BadInput(f"{option_of(error.field)}: expected {error.expected}, got {error.got}") from error


def _header(file: Path, made: Sheet, shown: Rig | None) -> dict[str, str]:
    """Return the header of the picture that is written."""
    found = read_attributes(file) if file.suffix.lower() == MASTER else {}
    kept = {name: text for name, text in found.items() if name != "rig"} | {names.KIND: names.ORTHOSCOPIC}
    # A rig describes all lenses or none: a hexagonal sheet turned otherwise than its header begins with the other row.
    named = shown is not None and display_size(shown) == made.layout
    return {**kept, "rig": shown.model_dump_json()} if shown is not None and named else kept


def _opened(file: Path, scratch: Path) -> AbstractContextManager[ScratchRows]:
    return decoded_rows(file, is_master=file.suffix.lower() == MASTER, scratch=scratch)


def _write(
    out: Path, made: Sheet, numbers: np.dtype[Any], *, space: ColourSpace, header: Mapping[str, str],
    bits: int | None, shown: Rig | None,
) -> None:  # fmt: skip
    is_light, master = np.issubdtype(numbers, np.floating), out.suffix.lower() == MASTER
    decoded = not is_light and space.name != "sRGB"
    light = is_light or decoded
    if bits is not None and (master or not light):
        raise BadInput(f"expected --bits for codes made of linear light only, got it for {out}")
    size, beside = (made.layout.rows, made.layout.cols), out.with_name(f".{out.stem}.part{out.suffix}")
    with ProgressLine("orthoscopic") as line:
        bands = _with_progress(stitched(made, BAND_PX), made.layout.rows, line)
        if decoded:
            bands = (light_of_codes(band, space) for band in bands)
        if master:
            halves = (band.astype(np.float16) for band in bands) if light else map(linear_light, bands)
            write_exr_rows(beside, halves, size=size, attributes=header)
        else:
            of_codes = bits or (8 if is_light else 8 * numbers.itemsize)
            codes = map(partial(srgb_codes, bits=of_codes), bands) if light else bands
            density = None if shown is None else sheet_density(made.layout, pitch_mm=shown.lens_array.pitch_mm)
            write_code_rows(beside, codes, size=size, bits=of_codes, density=density)
    beside.replace(out)


def _with_progress(bands: Iterator[NDArray[Any]], rows: int, line: ProgressLine) -> Iterator[NDArray[Any]]:
    done = 0
    for band in bands:
        yield band
        done += len(band)
        line.show(done / rows, f"{done} of {rows} rows")
