"""Depth maps of views."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from lippmann.cli.options import Frame, Source
from lippmann.client.connection import Connection
from lippmann.errors import BadInput
from lippmann.terminal.output import Output

if TYPE_CHECKING:
    from lippmann.local.pictures.depth import WrittenDepth


def depth(
    file: Source,
    out: Annotated[
        Path,
        typer.Option(
            help="The file to write: PNG in false colours, EXR with depth and disparity, or PFM of disparity."
        ),
    ],
    truth: Annotated[
        bool, typer.Option("--truth", help="Write the ground truth that capture.depth stored in depth/.")
    ] = False,
    u: Annotated[int | None, typer.Option("--u", help="The column of the view, from the left. It needs --v.")] = None,
    v: Annotated[int | None, typer.Option("--v", help="The row of the view, from the top. It needs --u.")] = None,
    method: Annotated[
        Literal["tensor", "sweep"],
        typer.Option(help="The method: the structure tensor of epipolar images, or a plane sweep."),
    ] = "tensor",
    reach: Annotated[int, typer.Option(min=1, help="The number of views on each side that the estimate uses.")] = 2,
    between: Annotated[
        str | None,
        typer.Option("--range", metavar="A:B", help="The range of depths of the estimate and of the colours, mm."),
    ] = None,
    border: Annotated[
        int, typer.Option(min=0, help="The pixels along each edge that the error statistics leave out.")
    ] = 5,
    frame: Frame = None,
    *,
    output: Output,
    connection: Connection,
) -> None:
    """Compute the depth map of a view. An estimate is compared with the ground truth if there is one."""
    from lippmann.cli.option_values import range_of
    from lippmann.local.files.open_master import open_master
    from lippmann.local.image import open_orthoscopic
    from lippmann.local.pictures.depth import write_depth

    if (u is None) != (v is None):
        raise BadInput("expected --u and --v, or neither for the view in the middle")
    range_mm = range_of(between) if between is not None else None
    with open_master(file, frame=frame, connection=connection, depth=True) as master:
        found = write_depth(
            open_orthoscopic(master, with_depth=True),
            out,
            truth=truth,
            number=(u, v) if u is not None and v is not None else None,
            method=method,
            reach=reach,
            range_mm=range_mm,
            border_px=border,
        )
    output.result(_data(found, border), _text(found, border))


def _data(found: WrittenDepth, border: int) -> dict[str, Any]:
    data: dict[str, Any] = {
        "file": str(found.file),
        "view": {"u": found.number[0], "v": found.number[1]},
        "source": found.depth.source,
        "errors": None,
    }
    if found.errors is not None:
        data["errors"] = {
            "badpix_percent": {f"{limit:g}": share for limit, share in found.errors.badpix_percent.items()},
            "mse_x100": found.errors.mse_x100,
            "q25_x100": found.errors.q25_x100,
            "pixels": found.errors.pixels,
            "pixels_percent": found.errors.pixels_percent,
            "border_px": border,
        }
    return data


def _text(found: WrittenDepth, border: int) -> str:
    if found.errors is None:
        return str(found.file)
    errors = found.errors
    bad = ", ".join(f"{share:.1f} % ({limit:g})" for limit, share in errors.badpix_percent.items())
    return "\n".join(
        (
            str(found.file),
            f"BadPix {bad}; MSE x 100 {errors.mse_x100:.2f}; Q25 x 100 {errors.q25_x100:.2f}",
            f"These are errors of the disparity in pitches a view, over {errors.pixels} pixels"
            f" ({errors.pixels_percent:.0f} %) that show a surface and lie at least {border} px from the edge.",
        )
    )
