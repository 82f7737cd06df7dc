"""Two integral images side by side, in numbers."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from lippmann.cli.options import AsJson
from lippmann.terminal.output import Talk


def compare(
    first: Annotated[Path, typer.Argument(metavar="A", help="An orthoscopic EXR or PNG, or a folder of frames.")],
    second: Annotated[Path, typer.Argument(metavar="B", help="The same once more, of the same size.")],
    px_per_lens: Annotated[
        int | None, typer.Option(min=1, help="Pixels across a square lens, where no EXR says it.")
    ] = None,
    lens_count: Annotated[
        tuple[int, int] | None, typer.Option(metavar="ROWS COLS", help="Lenses, where no EXR says it.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Compare two orthoscopic integral images: PSNR and SSIM of the sheet and of its views."""
    from lippmann.cli.text.compare import compared_data, compared_text
    from lippmann.local.compare import compare_here
    from lippmann.local.lens_options import said_lenses

    compared = compare_here(first, second, said=said_lenses(px_per_lens, lens_count))
    Talk(as_json).result(compared_data(compared), compared_text(compared))
