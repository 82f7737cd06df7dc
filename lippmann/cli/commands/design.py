"""The designer, and the sheet that calibrates a printer to an array."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from lippmann.cli.options import Overrides
from lippmann.job.presets import PRESETS
from lippmann.terminal.output import Output


def design(
    job_file: Annotated[
        str | None, typer.Argument(metavar="[JOB]", help="A job file, or - to read it from stdin.")
    ] = None,
    preset: Annotated[str | None, typer.Option(help=f"Take a preset: {', '.join(PRESETS)}.")] = None,
    scene: Annotated[
        str | None,
        typer.Option(help="A built-in scene, or a folder or zip with a scene. It replaces the scene of the job."),
    ] = None,
    frame: Annotated[
        int | None,
        typer.Option(min=1, max=999_999, help="The frame to compute. The default is the first frame of the job."),
    ] = None,
    svg: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Write a drawing of the optical bench to this file.", dir_okay=False),
    ] = None,
    overrides: Overrides = None,
    *,
    output: Output,
) -> None:
    """Compute what a job will give, without rendering. It is about image, views, display, depth and cost."""
    from lippmann.cli.text.design import design_text
    from lippmann.local.design import design_sheet
    from lippmann.local.files.writable import check_writable
    from lippmann.plan.design import designer

    sheet = design_sheet(job_file, preset=preset, scene=scene, overrides=overrides or ())
    found = designer.design(sheet, frame=frame)
    if svg is not None:
        check_writable(svg.absolute().parent)
        svg.write_text(designer.drawing(sheet, frame=frame) + "\n", encoding="utf-8")
        output.note(f"The drawing is in {svg}.")
    output.result(found.model_dump(mode="json"), design_text(found))


def calibration_sheet(
    out: Annotated[
        Path, typer.Option(help="The file to write: a .pdf of two pages, or a .tif or .png for each of the two pages.")
    ],
    pitch_mm: Annotated[float, typer.Option("--pitch-mm", help="The nominal pitch of the array, mm.")] = 1.0,
    lattice: Annotated[Literal["square", "hexagonal"], typer.Option(help="The lattice of the array.")] = "square",
    dpi: Annotated[float | None, typer.Option(help="The resolution of the printer, dots per inch.")] = None,
    pitch_um: Annotated[
        float | None,
        typer.Option("--pitch-um", help="The pixel pitch of the printer in micrometres, instead of --dpi."),
    ] = None,
    range_percent: Annotated[
        float, typer.Option("--range-percent", help="The largest deviation from the nominal pitch, percent.")
    ] = 1.0,
    steps: Annotated[int, typer.Option(help="The number of strips.")] = 21,
    length_mm: Annotated[
        float, typer.Option("--length-mm", help="The length of a strip, mm. A longer strip shows smaller deviations.")
    ] = 150.0,
    *,
    output: Output,
) -> None:
    """Write a sheet that shows the true pitch of an array. Under the array, one of its printed strips looks even."""
    from lippmann.local.calibration_sheet import write_calibration_sheet

    options = {"dpi": dpi, "pitch_um": pitch_um, "range_percent": range_percent, "steps": steps, "length_mm": length_mm}
    files = [str(path) for path in write_calibration_sheet(out, pitch_mm=pitch_mm, lattice=lattice, options=options)]
    output.result({"files": files}, "\n".join(files))
