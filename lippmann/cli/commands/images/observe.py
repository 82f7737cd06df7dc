"""The view of an observer of a display."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from lippmann.cli.options import Frame, Source
from lippmann.client.connection import Connection
from lippmann.errors import BadInput
from lippmann.job.optics.viewing import EYES_APART_MM, MOVING_RAYS, PUPIL_MM, RAYS, REACH_MM, SIZE_PX
from lippmann.terminal.output import Output

if TYPE_CHECKING:
    from lippmann.local.pictures.observe import Observation


def observe(
    file: Source,
    eye: Annotated[
        str,
        typer.Option(
            metavar="X,Y,Z", help="The position of the eye: mm to the right, up and in front of the display centre."
        ),
    ],
    out: Annotated[Path, typer.Option(help="The PNG file to write, or the MP4 file with --clip.")],
    stereo: Annotated[
        Literal["side_by_side", "cross_eyed", "anaglyph"] | None,
        typer.Option(help="Compute a stereo picture of two eyes on both sides of --eye."),
    ] = None,
    eye_distance_mm: Annotated[
        float, typer.Option("--eye-distance-mm", help="The distance between two eyes, mm.")
    ] = EYES_APART_MM,
    clip: Annotated[
        Literal["horizontal", "vertical", "circle", "toward"] | None,
        typer.Option(help="Write a clip in which the eye moves like this about its position."),
    ] = None,
    reach_mm: Annotated[
        float, typer.Option("--reach-mm", help="The distance that the eye moves from its position in a clip, mm.")
    ] = REACH_MM,
    seconds: Annotated[float, typer.Option(help="The length of a clip, s.")] = 4.0,
    fps: Annotated[float, typer.Option(help="The frames per second of a clip.")] = 24.0,
    gap: Annotated[
        Literal["real", "virtual", "collimated"] | None,
        typer.Option(help="Use the gap that `lippmann design` chooses for images of this kind."),
    ] = None,
    gap_mm: Annotated[
        float | None,
        typer.Option("--gap-mm", help="The reduced gap, mm. The default is one focal length of the lenses."),
    ] = None,
    physical_gap_mm: Annotated[
        float | None, typer.Option("--physical-gap-mm", help="The gap as it is built, including the substrate, mm.")
    ] = None,
    device: Annotated[
        bool, typer.Option("--device", help="Show the picture on the pixels of the display device of the rig.")
    ] = False,
    pupil_mm: Annotated[float, typer.Option("--pupil-mm", help="The diameter of the pupil, mm.")] = PUPIL_MM,
    focus_mm: Annotated[
        float,
        typer.Option("--focus-mm", help="The depth on which the eye focuses, mm. Positive is in front of the display."),
    ] = 0.0,
    size: Annotated[int, typer.Option(help="The longer side of the picture of one eye, px.")] = SIZE_PX,
    part: Annotated[
        str | None,
        typer.Option(metavar="X,Y,W,H", help="Show only a part of the display: its centre, width and height, mm."),
    ] = None,
    rays: Annotated[
        int | None,
        typer.Option(
            help=f"The rays for every pixel. The default is {RAYS}, and {MOVING_RAYS} in a clip.", show_default=False
        ),
    ] = None,
    bare: Annotated[
        Literal["clear", "black"], typer.Option(help="How the areas of the display look that no lens covers.")
    ] = "clear",
    surround: Annotated[
        Literal["black", "white"], typer.Option(help="How the area around the pixels looks.")
    ] = "black",
    frame: Frame = None,
    *,
    output: Output,
    connection: Connection,
) -> None:
    """Simulate what an eye sees of a print under its lenses. Pupil, pixels, gap and crosstalk are modelled."""
    from lippmann.cli.option_values import eye_of, part_of
    from lippmann.lightfield.observer.viewing_conditions import ViewingConditions
    from lippmann.lightfield.views.perspective import Eye
    from lippmann.local.files.displayed_image import Gap, open_displayed_image
    from lippmann.local.files.open_master import open_master
    from lippmann.local.pictures.observe import Clip, Observer, write_clip, write_observation

    if sum(choice is not None for choice in (gap, gap_mm, physical_gap_mm)) > 1:
        raise BadInput("expected at most one of --gap, --gap-mm and --physical-gap-mm, got more")
    rays = rays if rays is not None else MOVING_RAYS if clip else RAYS
    observer = Observer(
        place=Eye(*eye_of(eye)),
        conditions=ViewingConditions(
            pupil_mm=pupil_mm, focus_mm=focus_mm, rays=rays, stereo=stereo, eye_distance_mm=eye_distance_mm
        ),
        size_px=size,
        part_mm=part_of(part) if part is not None else None,
    )
    wanted_gap = Gap(reduced_mm=gap_mm, physical_mm=physical_gap_mm, use=gap)
    with open_master(file, frame=frame, connection=connection) as master:
        image = open_displayed_image(master, gap=wanted_gap, device=device, bare=bare, surround=surround)
    if clip is None:
        seen = write_observation(image, out, observer)
    else:
        seen = write_clip(image, out, observer, Clip(path=clip, reach_mm=reach_mm, seconds=seconds, fps=fps))
    _print_notes(seen, output)
    output.result({**asdict(seen), "file": str(seen.file)}, str(seen.file))


def _print_notes(seen: Observation, output: Output) -> None:
    if seen.own_share < 1:
        output.note(
            f"note: {1 - seen.own_share:.0%} of the lenses show a cell of a neighbour to an eye at this position;"
            f" the viewing zone of a lens is {seen.viewing_zone_mm:.0f} mm wide at this distance"
        )
    if abs(seen.depths_times - 1) > 1e-6:
        output.note(
            f"note: this gap multiplies depths by {seen.depths_times:.3g} compared with a gap of one focal length"
        )
