"""The conversion of a pseudoscopic capture."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from lippmann.cli.options import LensCount, Lenses
from lippmann.terminal.output import Output

Lattice = Literal["square", "hexagonal"]


def orthoscopic(
    file: Annotated[
        Path,
        typer.Argument(metavar="FILE", help="A pseudoscopic EXR, PNG or TIFF file, for example integral/0001.exr."),
    ],
    out: Annotated[Path, typer.Option(help="The EXR, PNG or TIFF file to write.")],
    px_per_lens: Annotated[
        int | None, typer.Option(help="The pixels across a lens. It is needed if no header gives it.")
    ] = None,
    lenses: Lenses = None,
    lens_count: LensCount = None,
    lattice: Annotated[
        Lattice | None, typer.Option(help="The lattice for --px-per-lens and --lenses. The default is square.")
    ] = None,
    turn_sheet: Annotated[
        bool | None,
        typer.Option(
            "--turn-sheet/--keep-sheet",
            help="Whether an imaging lens inverted the picture. The default is as the header says, or else no.",
            show_default=False,
        ),
    ] = None,
    pitch_mm: Annotated[
        float | None,
        typer.Option("--pitch-mm", help="The pitch of the capture's lenses, mm. It is needed if no header gives it."),
    ] = None,
    gap_mm: Annotated[
        float | None,
        typer.Option(
            "--gap-mm", help="The focal length of the capture's lenses, mm. It is needed if no header gives it."
        ),
    ] = None,
    display_lattice: Annotated[Lattice | None, typer.Option(help="The lattice of the other display.")] = None,
    display_lenses: Annotated[
        str | None,
        typer.Option(
            "--display-lenses",
            metavar="COLSxROWS",
            help="The number of lenses of the other display, across and down. The default covers the same area.",
        ),
    ] = None,
    display_count: Annotated[
        tuple[int, int] | None, typer.Option("--display-count", hidden=True, metavar="ROWS COLS")
    ] = None,
    display_pitch_mm: Annotated[
        float | None, typer.Option("--display-pitch-mm", help="The lens pitch of the other display, mm.")
    ] = None,
    display_px_per_lens: Annotated[
        int | None, typer.Option(help="The pixels across a lens of the other display.")
    ] = None,
    display_gap_mm: Annotated[
        float | None, typer.Option("--display-gap-mm", help="The reduced gap of the other display, mm.")
    ] = None,
    distance_mm: Annotated[
        float | None,
        typer.Option(
            "--distance-mm", help="The distance of the other display in front of the capture's own display, mm."
        ),
    ] = None,
    reference_mm: Annotated[
        float | None,
        typer.Option(
            "--reference-mm", help="The depth that SPOC keeps exactly, mm. The default is the scene's reference plane."
        ),
    ] = None,
    bits: Annotated[
        Literal["8", "16"] | None, typer.Option(help="The bits of each channel of a PNG or TIFF made from an EXR.")
    ] = None,
    linear: Annotated[
        bool,
        typer.Option("--linear", help="Read the codes of the pictures as linear light, whatever the files say."),
    ] = False,
    *,
    output: Output,
) -> None:
    """Make a pseudoscopic integral image orthoscopic. Every elemental image is turned by 180 degrees.

    The options of another display convert it for that display, by SPOC (smart pseudoscopic-to-orthoscopic conversion).
    """
    from lippmann.cli.option_values import count_of, layout_of
    from lippmann.local.pictures.orthoscopic import CaptureOptions, display_of, write_orthoscopic

    display = display_of(
        {
            "lattice": display_lattice,
            "count": count_of(display_lenses, display_count, option="--display-lenses", old_option="--display-count"),
            "pitch_mm": display_pitch_mm,
            "px_per_lens": display_px_per_lens,
            "gap_mm": display_gap_mm,
            "distance_mm": distance_mm,
            "reference_mm": reference_mm,
        }
    )
    capture = CaptureOptions(
        layout=layout_of(px_per_lens, count_of(lenses, lens_count), lattice),
        pitch_mm=pitch_mm,
        gap_mm=gap_mm,
        turn_sheet=turn_sheet,
    )
    code_bits = None if bits is None else int(bits)
    made = write_orthoscopic(file, out, capture=capture, display=display, bits=code_bits, linear=linear)
    for note in made.notes:
        output.note(f"note: {note}")
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
    output.result(data, f"{made.file}: {layout}, by {made.method}")
