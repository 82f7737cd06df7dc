"""One frame without a farm."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from lippmann.cli.options import AsJson, Overrides
from lippmann.terminal.output import Talk


def capture(
    scene: Annotated[
        str | None, typer.Argument(metavar="[SCENE]", help="A scene that comes along, or a folder or zip of your own.")
    ] = None,
    job_file: Annotated[str | None, typer.Option("--job", metavar="JOB.json", help="A job file; - for stdin.")] = None,
    frame: Annotated[int, typer.Option(min=1, max=999_999, help="Which frame.")] = 1,
    out: Annotated[Path, typer.Option(help="The folder to write to.")] = Path("out"),
    overrides: Overrides = None,
    as_json: AsJson = False,
) -> None:
    """Render one frame here, without a farm, by the code that a worker runs."""
    from lippmann.local.capture import capture_here

    talk = Talk(as_json)
    captured = capture_here(scene, job_file, overrides or (), frame=frame, out=out)
    for note in captured.notes:
        talk.note(f"note: {note}")
    files = [str(path) for path in captured.files]
    data = {"frame": frame, "files": files, "notes": list(captured.notes), "seconds": round(captured.seconds, 2)}
    talk.result(data, "\n".join(files))
