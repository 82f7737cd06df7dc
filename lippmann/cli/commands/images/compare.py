"""The comparison of two integral images."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from lippmann.cli.options import LensCount, Lenses
from lippmann.terminal.output import Output


def compare(
    first: Annotated[
        Path, typer.Argument(metavar="A", help="An orthoscopic integral image (EXR or PNG), or a folder of frames.")
    ],
    second: Annotated[
        Path, typer.Argument(metavar="B", help="The image or folder to compare with A, of the same size.")
    ],
    px_per_lens: Annotated[
        int | None,
        typer.Option(min=1, help="The pixels across a square lens. It is needed if no EXR header gives the lenses."),
    ] = None,
    lenses: Lenses = None,
    lens_count: LensCount = None,
    linear: Annotated[
        bool,
        typer.Option("--linear", help="Read the codes of the pictures as linear light, whatever the files say."),
    ] = False,
    *,
    output: Output,
) -> None:
    """Compare two integral images by PSNR and SSIM. The whole images and their views are compared."""
    from lippmann.cli.option_values import count_of, layout_of
    from lippmann.cli.text.compare import compared_data, compared_text
    from lippmann.local.studies.compare import compare_files, notes_of

    compared = compare_files(first, second, layout=layout_of(px_per_lens, count_of(lenses, lens_count)), linear=linear)
    for note in notes_of(compared, linear=linear):
        output.note(f"note: {note}")
    output.result(compared_data(compared), compared_text(compared))
