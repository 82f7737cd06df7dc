"""What an integral image gives: views and refocused pictures."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from lippmann.cli.options import DATA_DIR, AsJson, DataDir, Frame, Key, Source, Url
from lippmann.client.connection import Connection
from lippmann.errors import BadInput
from lippmann.job.viewing import Filter
from lippmann.terminal.output import Talk

Scale = Annotated[float | None, typer.Option(metavar="FACTOR", help="Write it so many times as large.")]
Size = Annotated[int | None, typer.Option(metavar="PX", help="Write it with so many px on the longer side.")]
FilterName = Annotated[Filter, typer.Option("--filter", help="By which it comes to another size.")]
PxPerLens = Annotated[int | None, typer.Option("--px-per-lens", metavar="N", help="Of the picture, from the sheet.")]


def view(
    file: Source,
    out: Annotated[Path, typer.Option(help="The PNG to write.")],
    u: Annotated[int | None, typer.Option("--u", help="Which view, from the left; with --v.")] = None,
    v: Annotated[int | None, typer.Option("--v", help="Which view, from the top; with --u.")] = None,
    centre: Annotated[bool, typer.Option("--centre", help="The view in the middle.")] = False,
    eye: Annotated[
        str | None,
        typer.Option(metavar="X,Y,Z", help="What an eye sees, mm from the middle of the display: right, up, in front."),
    ] = None,
    depth_mm: Annotated[
        float | None,
        typer.Option("--depth-mm", metavar="S", help="Several pixels a lens, joined up at this depth, + in front."),
    ] = None,
    px_per_lens: PxPerLens = None,
    scale: Scale = None,
    size: Size = None,
    filter_name: FilterName = "lanczos3",
    frame: Frame = None,
    as_json: AsJson = False,
    url: Url = None,
    key: Key = None,
    data_dir: DataDir = DATA_DIR,
) -> None:
    """Take one view of an integral image, what an eye sees of it, or a view that joins up at a depth."""
    from lippmann.local.files.open_master import lent_master
    from lippmann.local.picture_size import PictureSize
    from lippmann.local.view import depth_view_here, eye_here, view_here

    number = (u, v) if u is not None and v is not None else None
    if (u is None) != (v is None) or (number is not None) + centre + (eye is not None) != 1:
        raise BadInput("expected either --u and --v, or --centre, or --eye")
    if depth_mm is not None and eye is not None:
        raise BadInput("expected --depth-mm with --u and --v, or with --centre, got it with --eye")
    if px_per_lens is not None and depth_mm is None:
        raise BadInput("expected --px-per-lens with --depth-mm only: a view has one pixel a lens")
    wanted = PictureSize(scale=scale, longer_px=size, filter_name=filter_name)
    with lent_master(file, frame=frame, connection=Connection(url, key, data_dir)) as master:
        if eye is not None:
            seen = eye_here(master, out, place_mm=eye, size=wanted)
        elif depth_mm is not None:
            seen = depth_view_here(master, out, number=number, depth_mm=depth_mm, px_per_lens=px_per_lens, size=wanted)
        else:
            seen = view_here(master, out, number=number, size=wanted)
    talk = Talk(as_json)
    if seen.dark_lenses:
        talk.note(f"note: {seen.dark_lenses} lenses are dark: their light for this eye lies outside their own cell")
    data = {"file": str(seen.file), "rows": seen.rows, "cols": seen.cols, "dark_lenses": seen.dark_lenses}
    talk.result(data, str(seen.file))


def refocus(
    file: Source,
    out: Annotated[Path, typer.Option(help="The PNG to write; for a stack, the folder.")],
    depth_mm: Annotated[
        float | None, typer.Option("--depth-mm", metavar="S", help="Where to focus, + in front of the display.")
    ] = None,
    stack: Annotated[
        str | None, typer.Option(metavar="A:B:STEP", help="A picture for each of these depths, mm.")
    ] = None,
    extended: Annotated[bool, typer.Option("--extended", help="One picture, sharp at all depths of --stack.")] = False,
    method: Annotated[
        Literal["shift_and_sum", "ciir"],
        typer.Option(help="Views shifted and added, one pixel a lens; or cells magnified and laid over each other."),
    ] = "shift_and_sum",
    px_per_lens: PxPerLens = None,
    scale: Scale = None,
    size: Size = None,
    filter_name: FilterName = "lanczos3",
    frame: Frame = None,
    as_json: AsJson = False,
    url: Url = None,
    key: Key = None,
    data_dir: DataDir = DATA_DIR,
) -> None:
    """Focus an integral image anew at a depth, at many, or at all of them."""
    from lippmann.local.files.open_master import lent_master
    from lippmann.local.picture_size import PictureSize
    from lippmann.local.refocus import Focusing, depths_of, refocus_here, stack_here

    if (depth_mm is None) == (stack is None) or (extended and stack is None):
        raise BadInput("expected either --depth-mm, or --stack, with or without --extended")
    if extended and method == "ciir":
        # What CIIR has out of focus near the display is a pattern of cells, which counts as sharp.
        raise BadInput("expected --extended with --method shift_and_sum, got ciir")
    depths_mm = (depth_mm,) if depth_mm is not None else depths_of(stack or "")
    wanted = PictureSize(scale=scale, longer_px=size, filter_name=filter_name)
    focusing = Focusing(method=method, px_per_lens=px_per_lens, size=wanted)
    with lent_master(file, frame=frame, connection=Connection(url, key, data_dir)) as master:
        if stack is not None and not extended:
            files = [str(path) for path in stack_here(master, out, depths_mm=depths_mm, focusing=focusing)]
        else:
            refocus_here(master, out, depths_mm=depths_mm, focusing=focusing)
            files = [str(out)]
    data = {"files": files, "depths_mm": depths_mm, "extended": extended, "method": method}
    Talk(as_json).result(data, "\n".join(files))
