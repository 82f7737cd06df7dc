"""Outputs of masters that are there already."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from lippmann.cli.options import DATA_DIR, AsJson, DataDir, Key, Url
from lippmann.client.connection import Connection
from lippmann.errors import LippmannError
from lippmann.terminal.output import Talk

if TYPE_CHECKING:
    from worker.tasks.outputs.footage import Footage


def export(
    source: Annotated[str, typer.Argument(metavar="JOB", help="A job, an orthoscopic master, or a folder of them.")],
    outputs: Annotated[
        list[str],
        typer.Argument(metavar="OUTPUT...", help='quilt.png, views.webm, \'{"kind": "epi", ...}\': docs/outputs.md.'),
    ],
    out: Annotated[Path, typer.Option(help="The folder to write to.")] = Path("out"),
    frames: Annotated[str | None, typer.Option(help="Only these: 1-48:2,60.")] = None,
    fps: Annotated[float, typer.Option(min=0.001, help="Frames a second of a folder; a job knows its own.")] = 8.0,
    as_json: AsJson = False,
    url: Url = None,
    key: Key = None,
    data_dir: DataDir = DATA_DIR,
) -> None:
    """Make outputs, as a job makes them, of frames that are there already."""
    from lippmann.local.export import footage_of_job
    from lippmann.local.files.footage import files_footage

    if Path(source).exists():
        _export(files_footage(Path(source), frames=frames, fps=fps), outputs, out, as_json)
    else:
        with (
            Connection(url, key, data_dir).client() as client,
            footage_of_job(client, source, frames=frames) as footage,
        ):
            _export(footage, outputs, out, as_json)


def _export(footage: Footage, written: list[str], out: Path, as_json: bool) -> None:
    from lippmann.local.export import export_here, wanted_outputs

    made = export_here(footage, wanted_outputs(written, footage), out)
    data = [{"output": one.output, "files": [str(path) for path in one.files], "error": one.error} for one in made]
    text = "\n".join(str(path) for one in made for path in one.files)
    Talk(as_json).result(data, text)
    failed = [f"{one.output}: {one.error}" for one in made if one.error is not None]
    if failed:
        raise LippmannError("; ".join(failed))
