"""How deep what a view shows lies."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from lippmann.cli.options import DATA_DIR, AsJson, DataDir, Frame, Key, Source, Url
from lippmann.client.connection import Connection
from lippmann.errors import BadInput
from lippmann.terminal.output import Talk

if TYPE_CHECKING:
    from lippmann.local.depth import FoundDepth


def depth(
    file: Source,
    out: Annotated[Path, typer.Option(help="PNG: colours. EXR: s, disparity, confidence or z. PFM: disparity.")],
    truth: Annotated[
        bool, typer.Option("--truth", help="What capture.depth found, in depth/ beside the master.")
    ] = False,
    u: Annotated[int | None, typer.Option("--u", help="Which view, from the left; with --v.")] = None,
    v: Annotated[int | None, typer.Option("--v", help="Which view, from the top; with --u.")] = None,
    method: Annotated[
        Literal["tensor", "sweep"],
        typer.Option(help="Of the estimate: lines in epipolar images, or a plane swept through the depths."),
    ] = "tensor",
    reach: Annotated[int, typer.Option(min=1, help="How many views to each side the estimate looks at.")] = 2,
    between: Annotated[
        str | None,
        typer.Option(
            "--range", metavar="A:B", help="Between which depths the estimate looks, mm; colours reach as far."
        ),
    ] = None,
    border: Annotated[int, typer.Option(min=0, help="Pixels along each edge whose error does not count.")] = 5,
    frame: Frame = None,
    as_json: AsJson = False,
    url: Url = None,
    key: Key = None,
    data_dir: DataDir = DATA_DIR,
) -> None:
    """Tell how deep what a view shows lies; an estimate is compared with the truth where it is there."""
    from lippmann.local.depth import depth_here
    from lippmann.local.files.open_master import lent_master
    from lippmann.local.numbers import numbers_of

    if (u is None) != (v is None):
        raise BadInput("expected --u and --v, or neither for the view in the middle")
    far_near = numbers_of(between, ":", count=2, wanted="depths as A:B in mm") if between is not None else None
    with lent_master(file, frame=frame, connection=Connection(url, key, data_dir), depth=True) as master:
        found = depth_here(
            master,
            out,
            truth=truth,
            number=(u, v) if u is not None and v is not None else None,
            method=method,
            reach=reach,
            range_mm=(far_near[0], far_near[1]) if far_near else None,
            border_px=border,
        )
    Talk(as_json).result(_as_data(found, border), _text(found, border))


def _as_data(found: FoundDepth, border: int) -> dict[str, Any]:
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


def _text(found: FoundDepth, border: int) -> str:
    if found.errors is None:
        return str(found.file)
    errors = found.errors
    bad = ", ".join(f"{share:.1f} % ({limit:g})" for limit, share in errors.badpix_percent.items())
    return "\n".join(
        (
            str(found.file),
            f"BadPix {bad}; MSE x 100 {errors.mse_x100:.2f}; Q25 x 100 {errors.q25_x100:.2f}",
            f"of the disparity in pitches a view, over {errors.pixels} pixels ({errors.pixels_percent:.0f} %) that show"
            f" a surface and lie {border} px or more from the edge",
        )
    )
