"""What an eye sees of a display."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from lippmann.cli.options import DATA_DIR, AsJson, DataDir, Frame, Key, Source, Url
from lippmann.client.connection import Connection
from lippmann.errors import BadInput
from lippmann.job.viewing import EYES_APART_MM, MOVING_RAYS, PUPIL_MM, RAYS, REACH_MM, SIZE_PX
from lippmann.terminal.output import Talk

if TYPE_CHECKING:
    from lippmann.local.observe import Observed


def observe(
    file: Source,
    eye: Annotated[
        str, typer.Option(metavar="X,Y,Z", help="Where the eye is, mm from the display's middle: right, up, in front.")
    ],
    out: Annotated[Path, typer.Option(help="The PNG to write; with --clip, the MP4.")],
    stereo: Annotated[
        Literal["side_by_side", "cross_eyed", "anaglyph"] | None,
        typer.Option(help="Two eyes beside the place of --eye."),
    ] = None,
    eye_distance_mm: Annotated[float, typer.Option("--eye-distance-mm", help="Between two eyes.")] = EYES_APART_MM,
    clip: Annotated[
        Literal["horizontal", "vertical", "circle", "toward"] | None,
        typer.Option(help="A clip; how the eye moves about its place."),
    ] = None,
    reach_mm: Annotated[float, typer.Option("--reach-mm", help="How far the eye moves in a clip.")] = REACH_MM,
    seconds: Annotated[float, typer.Option(help="Length of a clip.")] = 4.0,
    fps: Annotated[float, typer.Option(help="Pictures a second of a clip.")] = 24.0,
    gap: Annotated[
        Literal["real", "virtual", "collimated"] | None,
        typer.Option(help="The gap that `lippmann design` chooses for images of this kind."),
    ] = None,
    gap_mm: Annotated[
        float | None, typer.Option("--gap-mm", help="The gap, reduced; one focal length when none is said.")
    ] = None,
    physical_gap_mm: Annotated[
        float | None, typer.Option("--physical-gap-mm", help="The gap as built, substrate included.")
    ] = None,
    device: Annotated[bool, typer.Option("--device", help="On the pixels of the rig's device.")] = False,
    pupil_mm: Annotated[float, typer.Option("--pupil-mm", help="Diameter of the pupil.")] = PUPIL_MM,
    focus_mm: Annotated[
        float, typer.Option("--focus-mm", help="The depth the eye focuses on, + in front of the display.")
    ] = 0.0,
    size: Annotated[int, typer.Option(help="Longer side of an eye's picture, px.")] = SIZE_PX,
    part: Annotated[
        str | None, typer.Option(metavar="X,Y,W,H", help="A part of the display, mm: its middle, its width and height.")
    ] = None,
    rays: Annotated[
        int | None, typer.Option(help=f"For every pixel; {RAYS}, in a clip {MOVING_RAYS}.", show_default=False)
    ] = None,
    bare: Annotated[Literal["clear", "black"], typer.Option(help="What is where no lens is.")] = "clear",
    surround: Annotated[Literal["black", "white"], typer.Option(help="What is beyond the pixels.")] = "black",
    frame: Frame = None,
    as_json: AsJson = False,
    url: Url = None,
    key: Key = None,
    data_dir: DataDir = DATA_DIR,
) -> None:
    """Show what an eye sees of a print or panel under its lenses, with all that a display does wrong."""
    from lippmann.lightfield.observer.looking import Looking
    from lippmann.local.display import GapWish, read_shown
    from lippmann.local.files.open_master import lent_master
    from lippmann.local.observe import Clip, Observer, clip_here, observe_here, part_of
    from lippmann.local.view import eye_at

    if sum(said is not None for said in (gap, gap_mm, physical_gap_mm)) > 1:
        raise BadInput("expected at most one of --gap, --gap-mm and --physical-gap-mm, got more")
    rays = rays if rays is not None else MOVING_RAYS if clip else RAYS
    observer = Observer(
        place=eye_at(eye),
        looking=Looking(
            pupil_mm=pupil_mm, focus_mm=focus_mm, rays=rays, stereo=stereo, eye_distance_mm=eye_distance_mm
        ),
        size_px=size,
        part_mm=part_of(part) if part is not None else None,
    )
    wish = GapWish(reduced_mm=gap_mm, physical_mm=physical_gap_mm, use=gap)
    with lent_master(file, frame=frame, connection=Connection(url, key, data_dir)) as master:
        shown = read_shown(master, gap=wish, device=device, bare=bare, surround=surround)
    if clip is None:
        seen = observe_here(shown, out, observer)
    else:
        seen = clip_here(shown, out, observer, Clip(path=clip, reach_mm=reach_mm, seconds=seconds, fps=fps))
    talk = Talk(as_json)
    _notes(talk, seen)
    talk.result({**asdict(seen), "file": str(seen.file)}, str(seen.file))


def _notes(talk: Talk, seen: Observed) -> None:
    if seen.own_share < 1:
        talk.note(
            f"note: {1 - seen.own_share:.0%} of the lenses show a neighbour's cell to an eye there; at its distance the"
            f" viewing zone of a lens is {seen.viewing_zone_mm:.0f} mm wide"
        )
    if abs(seen.depths_times - 1) > 1e-6:
        talk.note(f"note: the gap shows depths {seen.depths_times:.3g} times as deep as one of a focal length")
