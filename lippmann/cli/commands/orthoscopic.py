"""A capture into what is shown."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from lippmann.cli.options import AsJson
from lippmann.terminal.output import Talk

Lattice = Literal["square", "hexagonal"]


def orthoscopic(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="A pseudoscopic EXR, PNG or TIFF: integral/0001.exr.")],
    out: Annotated[Path, typer.Option(help="The EXR, PNG or TIFF to write.")],
    px_per_lens: Annotated[int | None, typer.Option(help="Pixels across a lens, where no header says it.")] = None,
    lens_count: Annotated[
        tuple[int, int] | None, typer.Option(metavar="ROWS COLS", help="Lenses, where no header says it.")
    ] = None,
    lattice: Annotated[Lattice | None, typer.Option(help="With these two; square when nothing is said.")] = None,
    turn_sheet: Annotated[
        bool | None,
        typer.Option(
            "--turn-sheet/--keep-sheet",
            help="Whether an imaging lens turned the picture upside down; else as the header says, else not.",
            show_default=False,
        ),
    ] = None,
    pitch_mm: Annotated[
        float | None, typer.Option("--pitch-mm", help="Of the capture's lenses, where no header says it.")
    ] = None,
    gap_mm: Annotated[
        float | None, typer.Option("--gap-mm", help="Their focal length, where no header says it.")
    ] = None,
    display_lattice: Annotated[Lattice | None, typer.Option(help="Of another display.")] = None,
    display_count: Annotated[
        tuple[int, int] | None, typer.Option(metavar="ROWS COLS", help="Its lenses; else as many on the same area.")
    ] = None,
    display_pitch_mm: Annotated[float | None, typer.Option("--display-pitch-mm", help="Of its lenses.")] = None,
    display_px_per_lens: Annotated[int | None, typer.Option(help="Pixels across one of them.")] = None,
    display_gap_mm: Annotated[
        float | None, typer.Option("--display-gap-mm", help="From its lenses to its pixels, reduced.")
    ] = None,
    distance_mm: Annotated[
        float | None, typer.Option("--distance-mm", help="How far in front of the capture's own display it stands.")
    ] = None,
    reference_mm: Annotated[
        float | None, typer.Option("--reference-mm", help="The depth that is kept exactly; else the scene's plane.")
    ] = None,
    bits: Annotated[
        Literal["8", "16"] | None, typer.Option(help="A channel, of an EXR made into a PNG or a TIFF.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Make a pseudoscopic integral image orthoscopic: by the half-turn, or by SPOC for another display."""
    from lippmann.local.lens_options import said_lenses
    from lippmann.local.orthoscopic import Capture, display_of, orthoscopic_here

    display = display_of(
        {
            "lattice": display_lattice,
            "count": display_count,
            "pitch_mm": display_pitch_mm,
            "px_per_lens": display_px_per_lens,
            "gap_mm": display_gap_mm,
            "distance_mm": distance_mm,
            "reference_mm": reference_mm,
        }
    )
    said = Capture(
        layout=said_lenses(px_per_lens, lens_count, lattice), pitch_mm=pitch_mm, gap_mm=gap_mm, turn_sheet=turn_sheet
    )
    made = orthoscopic_here(file, out, said=said, display=display, bits=None if bits is None else int(bits))
    layout = made.layout
    data = {
        "file": str(made.file),
        "method": made.method,
        "sheet_turned": made.sheet_turned,
        "lenses": {
            "count": [layout.lens_rows, layout.lens_cols],
            "px_per_lens": layout.px_per_lens,
            "lattice": layout.lattice,
            "first_row_shifted": layout.first_row_shifted,
        },
        "size_px": [layout.rows, layout.cols],
    }
    Talk(as_json).result(data, f"{made.file}: {layout}, by {made.method}")
