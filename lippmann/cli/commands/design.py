"""What a job will give, before anything is rendered."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from lippmann.cli.options import AsJson, Overrides
from lippmann.terminal.output import Talk


def design(
    job_file: Annotated[str | None, typer.Argument(metavar="[JOB]", help="A job file; - for stdin.")] = None,
    preset: Annotated[str | None, typer.Option(help="A job of the paper: paper-still, paper-iv.")] = None,
    scene: Annotated[
        str | None, typer.Option(help="A scene that comes along, or a folder or zip of your own; before the job's.")
    ] = None,
    frame: Annotated[
        int | None, typer.Option(min=1, max=999_999, help="At which frame; the first one when not said.")
    ] = None,
    svg: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write the drawing of the bench there.", dir_okay=False)
    ] = None,
    overrides: Overrides = None,
    as_json: AsJson = False,
) -> None:
    """Tell what a job will give: lens, image, views, display, depth budget, cost; renders nothing."""
    from lippmann.cli.text.design import design_text
    from lippmann.local.design import design_here

    talk = Talk(as_json)
    found = design_here(
        job_file, overrides or (), preset=preset, scene=scene, frame=frame, with_drawing=svg is not None
    )
    if svg is not None and found.svg is not None:
        svg.write_text(found.svg + "\n", encoding="utf-8")
        talk.note(f"the drawing is in {svg}")
    talk.result(found.numbers.model_dump(mode="json"), design_text(found.numbers))
