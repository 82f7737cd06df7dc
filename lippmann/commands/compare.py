"""Two integral images side by side, in numbers."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from lippmann.commands.options import AsJson
from lippmann.talk import Talk

if TYPE_CHECKING:
    from worker.integral.layout import CellLayout


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
    from lippmann.commands.shown_compare import compared_data, compared_text
    from lippmann.compare_here import compare_here

    compared = compare_here(first, second, said=_said(px_per_lens, lens_count))
    Talk(as_json).result(compared_data(compared), compared_text(compared))


def _said(px_per_lens: int | None, lens_count: tuple[int, int] | None) -> CellLayout | None:
    from lippmann.errors import BadInput
    from worker.errors import LayoutError
    from worker.integral.layout import CellLayout

    if px_per_lens is None and lens_count is None:
        return None
    if px_per_lens is None or lens_count is None:
        got = "--lens-count" if px_per_lens is None else "--px-per-lens"
        raise BadInput(f"expected both --px-per-lens and --lens-count, or neither, got only {got}")
    try:
        return CellLayout(*lens_count, px_per_lens=px_per_lens)
    except LayoutError as error:
        raise BadInput(f"--lens-count: {error.message}") from error
