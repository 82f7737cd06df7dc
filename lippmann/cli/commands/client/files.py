"""The files of jobs: fetch them, and link one of them."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from lippmann.cli.exit_codes import ExitCode
from lippmann.cli.options import RECONNECT_S, JobId, finite
from lippmann.client.connection import Connection
from lippmann.terminal.output import Output
from lippmann.terminal.progress import time_text


def fetch(
    job_id: JobId,
    out: Annotated[
        Path | None, typer.Option(help="The folder to write to. The default is out/JOB/. Each job has its own.")
    ] = None,
    frames: Annotated[
        str | None, typer.Option(help="Fetch only the pictures of these frames, for example 1-48:2,60.")
    ] = None,
    masters: Annotated[bool, typer.Option("--masters", help="Fetch the EXR masters instead of PNG pictures.")] = False,
    outputs: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME",
            help="Fetch only this output, for example views.mp4, and pictures only with --frames. The option may be "
            "repeated, or hold several names separated by commas.",
        ),
    ] = None,
    parallel: Annotated[
        int,
        typer.Option(
            envvar="LIPPMANN_FETCH_PARALLEL",
            min=1,
            max=32,
            help="The number of files that are fetched at the same time.",
        ),
    ] = 4,
    *,
    output: Output,
    connection: Connection,
) -> None:
    """Fetch the pictures and outputs of a job. Files that are complete in the folder are not fetched again.

    If the job has not made everything, missing.json in the folder says what is missing and why, and the exit code is 5.
    """
    from lippmann.client.fetch import fetch_job, fetch_text
    from lippmann.client.missing import missing_text

    folder = Path("out", job_id) if out is None else out
    wanted = None if outputs is None else [name.strip() for text in outputs for name in text.split(",")]
    with connection.client(patience_s=RECONNECT_S) as client:
        result = fetch_job(client, job_id, folder, frames=frames, masters=masters, outputs=wanted, parallel=parallel)
    data = {
        "folder": str(result.folder),
        "files": [str(path) for path in result.files],
        "brought": result.fetched,
        "bytes_brought": result.fetched_bytes,
        "missing": asdict(result.missing) if result.missing else None,
    }
    output.result(data, fetch_text(result))
    if result.missing:
        output.note(missing_text(result.missing, folder))
        raise typer.Exit(ExitCode.INCOMPLETE)


def link(
    job_id: JobId,
    artifact: Annotated[
        str, typer.Argument(metavar="FILE", help="The name of a file of the job, such as video/views.mp4.")
    ],
    hours: Annotated[
        float | None,
        typer.Option(min=0.001, callback=finite, help="The hours until the link expires. By default a day."),
    ] = None,
    *,
    output: Output,
    connection: Connection,
) -> None:
    """Create a link to one file of a job. Anybody can download the file without a key until the link expires."""
    with connection.client() as client:
        made = client.artifact_link(job_id, artifact, expires_in_s=None if hours is None else hours * 3600)
    output.note(f"The link is valid until {time_text(made.expires_at)}:")
    output.result(made.model_dump(mode="json"), made.url)
