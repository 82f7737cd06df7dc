"""What an integral image gives: views and refocused pictures."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from lippmann.commands.options import AsJson
from lippmann.errors import BadInput
from lippmann.talk import Talk

Master = Annotated[Path, typer.Argument(metavar="FILE", help="An orthoscopic master: orthoscopic/0001.exr.")]


def view(
    file: Master,
    out: Annotated[Path, typer.Option(help="The PNG to write.")],
    u: Annotated[int | None, typer.Option("--u", help="Which view, from the left; with --v.")] = None,
    v: Annotated[int | None, typer.Option("--v", help="Which view, from the top; with --u.")] = None,
    centre: Annotated[bool, typer.Option("--centre", help="The view in the middle.")] = False,
    eye: Annotated[
        str | None,
        typer.Option(metavar="X,Y,Z", help="What an eye sees, mm from the middle of the display: right, up, in front."),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Take one view of an integral image, or what an eye sees of it, one pixel a lens."""
    from lippmann.view_here import eye_here, view_here

    number = (u, v) if u is not None and v is not None else None
    if (u is None) != (v is None) or (number is not None) + centre + (eye is not None) != 1:
        raise BadInput("expected either --u and --v, or --centre, or --eye")
    seen = view_here(file, out, number=number) if eye is None else eye_here(file, out, place_mm=eye)
    talk = Talk(as_json)
    if seen.dark_lenses:
        talk.note(f"note: {seen.dark_lenses} lenses are dark: their light for this eye lies outside their own cell")
    data = {"file": str(seen.file), "rows": seen.rows, "cols": seen.cols, "dark_lenses": seen.dark_lenses}
    talk.result(data, str(seen.file))


def refocus(
    file: Master,
    out: Annotated[Path, typer.Option(help="The PNG to write; for a stack, the folder.")],
    depth_mm: Annotated[
        float | None, typer.Option("--depth-mm", metavar="S", help="Where to focus, + in front of the display.")
    ] = None,
    stack: Annotated[
        str | None, typer.Option(metavar="A:B:STEP", help="A picture for each of these depths, mm.")
    ] = None,
    extended: Annotated[bool, typer.Option("--extended", help="One picture, sharp at all depths of --stack.")] = False,
    as_json: AsJson = False,
) -> None:
    """Focus an integral image anew at a depth, at many, or at all of them."""
    from lippmann.view_here import depths_of, refocus_here, stack_here

    if (depth_mm is None) == (stack is None) or (extended and stack is None):
        raise BadInput("expected either --depth-mm, or --stack, with or without --extended")
    depths_mm = (depth_mm,) if depth_mm is not None else depths_of(stack or "")
    if stack is not None and not extended:
        files = [str(path) for path in stack_here(file, out, depths_mm=depths_mm)]
    else:
        refocus_here(file, out, depths_mm=depths_mm)
        files = [str(out)]
    Talk(as_json).result({"files": files, "depths_mm": depths_mm, "extended": extended}, "\n".join(files))
