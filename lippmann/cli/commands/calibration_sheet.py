"""What a printer makes of an array's pitch."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from lippmann.cli.options import AsJson
from lippmann.terminal.output import Talk


def calibration_sheet(
    out: Annotated[Path, typer.Option(help="The .pdf of two pages, or .tif or .png, of which there are two.")],
    pitch_mm: Annotated[float, typer.Option("--pitch-mm", help="Of the array's lenses, as it is sold.")] = 1.0,
    lattice: Annotated[Literal["square", "hexagonal"], typer.Option(help="How the lenses stand.")] = "square",
    dpi: Annotated[float | None, typer.Option(help="Of the printer.")] = None,
    pitch_um: Annotated[float | None, typer.Option("--pitch-um", help="Pitch of its pixels, instead of --dpi.")] = None,
    range_percent: Annotated[float, typer.Option("--range-percent", help="How far strips go to both sides.")] = 1.0,
    steps: Annotated[int, typer.Option(help="How many strips.")] = 21,
    length_mm: Annotated[float, typer.Option("--length-mm", help="Of a strip: the longer, the finer.")] = 150.0,
    as_json: AsJson = False,
) -> None:
    """Write a sheet that finds the true pitch of an array on a printer: strips of lines, one of which looks even."""
    from lippmann.local.calibration_sheet import calibration_here

    options = {"dpi": dpi, "pitch_um": pitch_um, "range_percent": range_percent, "steps": steps, "length_mm": length_mm}
    files = [str(path) for path in calibration_here(out, pitch_mm=pitch_mm, lattice=lattice, options=options)]
    Talk(as_json).result({"files": files}, "\n".join(files))
