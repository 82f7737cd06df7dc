"""A calibration sheet on disk, without a job."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pydantic import ValidationError

from lippmann.errors import BadInput, FieldProblem
from lippmann.job.outputs.prints import CalibrationSheet
from lippmann.job.problems import Misfit, problems_of
from lippmann.job.rig import Rig
from lippmann.local.files.writable import check_writable
from worker.tasks.outputs.calibration import sheet_files, write_sheet

FORMATS = {spelling: options.get("file_format", "pdf") for spelling, options in CalibrationSheet.SPELLINGS.items()}
"""By suffix, what is written."""


def calibration_here(out: Path, *, pitch_mm: float, lattice: str, options: dict[str, Any]) -> tuple[Path, ...]:
    """Write a sheet: a PDF of two pages, or as TIFF or PNG a picture for each direction.

    Parameters
    ----------
    out
        A .pdf, .tif or .png; of pictures, `-across` and `-down` come before the suffix.
    pitch_mm, lattice
        Of the array.
    options
        Of `CalibrationSheet`: dpi, pitch_um, range_percent and so on.

    Returns
    -------
    tuple
        What was written.

    Raises
    ------
    BadInput
        If such a sheet cannot be, naming what is wrong.
    """
    suffix = out.suffix.lower()
    if suffix not in FORMATS:
        raise BadInput(f"expected a {', '.join(FORMATS)} in --out, got {out}")
    if (options["dpi"] is None) == (options["pitch_um"] is None):
        raise BadInput("expected either --dpi or --pitch-um")
    try:
        rig = Rig.model_validate({"lens_array": {"pitch_mm": pitch_mm, "lattice": lattice}})
        sheet = CalibrationSheet.model_validate({"file_format": FORMATS[suffix], **options})
        sheet.check(rig, ())
    except ValidationError as error:
        raise BadInput("; ".join(map(_said, problems_of(error)))) from error
    except Misfit as wrong:
        raise BadInput(_said(FieldProblem(wrong.field, wrong.expected, wrong.got))) from wrong
    check_writable(out.parent)
    written = []
    for file, pages in sheet_files(sheet, rig):
        path = out.with_name(file.replace(sheet.name, out.stem, 1)).with_suffix(out.suffix)
        write_sheet(path, output=sheet, pages=pages)
        written.append(path)
    return tuple(written)


def _said(problem: FieldProblem) -> str:
    option = problem.field.rpartition(".")[2].replace("_", "-")
    return f"--{option}: expected {problem.expected}, got {problem.got}"
