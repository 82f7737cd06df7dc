"""Write a calibration sheet without a job."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pydantic import ValidationError

from lippmann.errors import BadInput, FieldProblem
from lippmann.job.fields.problems import FieldError, problems_of
from lippmann.job.optics.rig import Rig
from lippmann.job.outputs.prints import CalibrationSheet
from lippmann.local.files.writable import check_writable
from worker.tasks.outputs.prints import sheet_files, write_sheet

FORMATS = {spelling: options.get("file_format", "pdf") for spelling, options in CalibrationSheet.SPELLINGS.items()}
"""The file format of each suffix."""


def write_calibration_sheet(out: Path, *, pitch_mm: float, lattice: str, options: dict[str, Any]) -> tuple[Path, ...]:
    """Write a calibration sheet: a PDF of two pages, or a TIFF or PNG for each direction.

    Parameters
    ----------
    out
        A .pdf, .tif or .png; the names of pictures get `-across` and `-down` before the suffix.
    pitch_mm, lattice
        The pitch, mm, and the lattice of the lens array.
    options
        The fields of `CalibrationSheet`: dpi, pitch_um, range_percent and so on.

    Returns
    -------
    tuple
        The files.

    Raises
    ------
    BadInput
        If there can be no such sheet; the message names the option.
    """
    suffix = out.suffix.lower()
    if suffix not in FORMATS:
        raise BadInput(f"expected a file name in --out that ends in one of {', '.join(FORMATS)}, got {out}")
    if (options["dpi"] is None) == (options["pitch_um"] is None):
        raise BadInput(f"expected either --dpi or --pitch-um, got {'neither' if options['dpi'] is None else 'both'}")
    try:
        rig = Rig.model_validate({"lens_array": {"pitch_mm": pitch_mm, "lattice": lattice}})
        sheet = CalibrationSheet.model_validate({"file_format": FORMATS[suffix], **options})
        sheet.check(rig, ())
    except ValidationError as error:
        raise BadInput("; ".join(map(_message, problems_of(error)))) from error
    except FieldError as wrong:
        raise BadInput(_message(FieldProblem(wrong.field, wrong.expected, wrong.got))) from wrong
    check_writable(out.parent)
    written = []
    for file, pages in sheet_files(sheet, rig):
        path = out.with_name(file.replace(sheet.name, out.stem, 1)).with_suffix(out.suffix)
        write_sheet(path, output=sheet, pages=pages)
        written.append(path)
    return tuple(written)


def _message(problem: FieldProblem) -> str:
    option = problem.field.rpartition(".")[2].replace("_", "-")
    return f"--{option}: expected {problem.expected}, got {problem.got}"
