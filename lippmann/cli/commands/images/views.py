"""Views and refocused pictures of an integral image."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from lippmann.cli.options import Frame, Source
from lippmann.client.connection import Connection
from lippmann.errors import BadInput
from lippmann.job.optics.viewing import Filter
from lippmann.terminal.output import Output

Scale = Annotated[float | None, typer.Option(metavar="FACTOR", help="Enlarge or reduce the picture by this factor.")]
Size = Annotated[
    int | None, typer.Option(metavar="PX", help="Enlarge or reduce the picture to this many pixels on its longer side.")
]
FilterName = Annotated[Filter, typer.Option("--filter", help="The resampling filter for --scale and --size.")]
PxPerLens = Annotated[
    int | None, typer.Option("--px-per-lens", metavar="N", help="The pixels that the picture has for each lens.")
]


def view(
    file: Source,
    out: Annotated[Path, typer.Option(help="The PNG file to write; with --channel also EXR or PFM.")],
    u: Annotated[int | None, typer.Option("--u", help="The column of the view, from the left. It needs --v.")] = None,
    v: Annotated[int | None, typer.Option("--v", help="The row of the view, from the top. It needs --u.")] = None,
    centre: Annotated[bool, typer.Option("--centre", help="Take the central view.")] = False,
    eye: Annotated[
        str | None,
        typer.Option(
            metavar="X,Y,Z",
            help="Compute what an eye sees at this position: mm to the right, up and in front of the display centre.",
        ),
    ] = None,
    depth_mm: Annotated[
        float | None,
        typer.Option(
            "--depth-mm",
            metavar="S",
            help="Use several pixels of each lens, joined at this depth, mm. Positive is in front of the display.",
        ),
    ] = None,
    channel: Annotated[
        Literal["normal", "albedo", "object", "motion"] | None,
        typer.Option(help="Write this channel of capture.channels in place of the colours."),
    ] = None,
    px_per_lens: PxPerLens = None,
    scale: Scale = None,
    size: Size = None,
    filter_name: FilterName = "lanczos3",
    frame: Frame = None,
    *,
    output: Output,
    connection: Connection,
) -> None:
    """Extract a view, or compute what an eye sees. `lippmann observe` also models pupil, lenses and gap."""
    from lippmann.cli.option_values import eye_of
    from lippmann.local.files.open_master import open_master
    from lippmann.local.files.picture_size import PictureSize
    from lippmann.local.image import open_orthoscopic
    from lippmann.local.pictures.channel_view import write_channel_view
    from lippmann.local.pictures.view import write_depth_focused_view, write_perspective, write_view

    number = (u, v) if u is not None and v is not None else None
    if (u is None) != (v is None) or (number is not None) + centre + (eye is not None) != 1:
        raise BadInput("expected either --u and --v, or --centre, or --eye")
    if depth_mm is not None and eye is not None:
        raise BadInput("expected --depth-mm with --u and --v, or with --centre, got it with --eye")
    if px_per_lens is not None and depth_mm is None:
        raise BadInput("expected --px-per-lens with --depth-mm only: a view has one pixel a lens")
    wanted = PictureSize(scale=scale, longer_px=size, filter_name=filter_name)
    if channel is not None:
        if eye is not None or depth_mm is not None or scale is not None or size is not None:
            raise BadInput("expected --channel without --eye, --depth-mm, --scale and --size: its numbers do not mix")
        with open_master(file, frame=frame, connection=connection, channels=True) as master:
            shown = write_channel_view(master, out, channel, number=number)
        numbers = {"view": {"u": shown.number[0], "v": shown.number[1]}, "rows": shown.rows, "cols": shown.cols}
        output.result({"file": str(out), "channel": channel, **numbers, "objects": list(shown.objects)}, str(out))
        return
    with open_master(file, frame=frame, connection=connection) as master:
        image = open_orthoscopic(master)
    if eye is not None:
        seen = write_perspective(image, out, eye=eye_of(eye), size=wanted)
    elif depth_mm is not None:
        seen = write_depth_focused_view(
            image, out, number=number, depth_mm=depth_mm, px_per_lens=px_per_lens, size=wanted
        )
    else:
        seen = write_view(image, out, number=number, size=wanted)
    if seen.dark_lenses:
        output.note(
            f"note: {seen.dark_lenses} lenses are dark, because their light for this eye lies outside their own cell"
        )
    data = {"file": str(seen.file), "rows": seen.rows, "cols": seen.cols, "dark_lenses": seen.dark_lenses}
    output.result(data, str(seen.file))


def refocus(
    file: Source,
    out: Annotated[Path, typer.Option(help="The PNG file to write, or the folder of a focal stack.")],
    depth_mm: Annotated[
        float | None,
        typer.Option("--depth-mm", metavar="S", help="The depth to focus on, mm. Positive is in front of the display."),
    ] = None,
    stack: Annotated[
        str | None,
        typer.Option(metavar="A:B:STEP", help="Write a focal stack: one picture for each of these depths, mm."),
    ] = None,
    all_in_focus: Annotated[
        bool, typer.Option("--all-in-focus", help="Write one all-in-focus picture of the depths of --stack.")
    ] = False,
    extended: Annotated[bool, typer.Option("--extended", hidden=True, help="The old name of --all-in-focus.")] = False,
    method: Annotated[
        Literal["shift_and_sum", "ciir"],
        typer.Option(
            help="The method: shift_and_sum adds shifted views (one pixel a lens), and ciir superimposes magnified"
            " elemental images."
        ),
    ] = "shift_and_sum",
    px_per_lens: PxPerLens = None,
    scale: Scale = None,
    size: Size = None,
    filter_name: FilterName = "lanczos3",
    frame: Frame = None,
    *,
    output: Output,
    connection: Connection,
) -> None:
    """Refocus at one depth, as a focal stack, or all in focus."""
    from lippmann.cli.option_values import depths_of
    from lippmann.local.files.open_master import open_master
    from lippmann.local.files.picture_size import PictureSize
    from lippmann.local.image import open_orthoscopic
    from lippmann.local.pictures.refocus import RefocusOptions, write_all_in_focus, write_focal_stack, write_refocused

    if extended:
        output.note("--extended is called --all-in-focus; the old name works until the next release.")
        all_in_focus = True
    if (depth_mm is None) == (stack is None) or (all_in_focus and stack is None):
        raise BadInput("expected either --depth-mm, or --stack with or without --all-in-focus")
    if all_in_focus and method == "ciir":
        # Near the display, CIIR turns what is out of focus into a pattern of cells, which the focus measure takes for
        # detail.
        raise BadInput("expected --all-in-focus with --method shift_and_sum, got ciir")
    depths_mm = (depth_mm,) if depth_mm is not None else depths_of(stack or "")
    wanted = PictureSize(scale=scale, longer_px=size, filter_name=filter_name)
    options = RefocusOptions(method=method, px_per_lens=px_per_lens, size=wanted)
    with open_master(file, frame=frame, connection=connection) as master:
        image = open_orthoscopic(master)
    files = [str(out)]
    if depth_mm is not None:
        write_refocused(image, out, depth_mm=depth_mm, options=options)
    elif all_in_focus:
        write_all_in_focus(image, out, depths_mm=depths_mm, size=wanted)
    else:
        files = [str(path) for path in write_focal_stack(image, out, depths_mm=depths_mm, options=options)]
    data = {"files": files, "depths_mm": depths_mm, "all_in_focus": all_in_focus, "method": method}
    output.result(data, "\n".join(files))
