"""Outputs of masters that exist already."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from lippmann.cli.options import OutputFolder
from lippmann.client.connection import Connection
from lippmann.errors import LippmannError
from lippmann.terminal.output import Output

if TYPE_CHECKING:
    from worker.tasks.outputs.frame_source import FrameSource


def export(
    source: Annotated[
        str, typer.Argument(metavar="JOB", help="The id of a job, an orthoscopic master, or a folder of masters.")
    ],
    outputs: Annotated[
        list[str],
        typer.Argument(
            metavar="OUTPUT...",
            help='The outputs (`lippmann docs outputs`), for example quilt.png, views.webm or \'{"kind": "epi"}\'.',
        ),
    ],
    out: OutputFolder = Path("out"),
    frames: Annotated[str | None, typer.Option(help="Use only these frames, for example 1-48:2,60.")] = None,
    fps: Annotated[
        float,
        typer.Option(min=0.001, help="The frames per second of a folder of masters. A job has its own frame rate."),
    ] = 8.0,
    *,
    output: Output,
    connection: Connection,
) -> None:
    """Make the outputs of a job from frames that exist already."""
    from lippmann.cli.option_values import frames_of
    from lippmann.local.files.frame_source import files_frames
    from lippmann.local.pictures.export import frames_of_job, read_outputs

    frames_of(frames)  # A mistake is found before any frame is fetched.
    read_outputs(outputs)
    if Path(source).exists():
        _export(files_frames(Path(source), frames=frames, fps=fps), outputs, out, output)
    else:
        with connection.client() as client, frames_of_job(client, source, frames=frames) as frame_source:
            _export(frame_source, outputs, out, output)


def _export(frame_source: FrameSource, outputs: list[str], out: Path, output: Output) -> None:
    from lippmann.local.pictures.export import export_outputs, parse_outputs

    made = export_outputs(frame_source, parse_outputs(outputs, frame_source), out)
    data = [{"output": one.output, "files": [str(path) for path in one.files], "error": one.error} for one in made]
    output.result(data, "\n".join(str(path) for one in made for path in one.files))
    failed = [f"{one.output}: {one.error}" for one in made if one.error is not None]
    if failed:
        raise LippmannError("; ".join(failed))
