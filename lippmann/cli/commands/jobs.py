"""Jobs: submit, list, show their tasks, watch, fetch, link files, and the actions on jobs."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from lippmann.cli.exit_codes import ExitCode
from lippmann.cli.options import RECONNECT_S, JobId, OutputFolder, Overrides
from lippmann.client.connection import Connection
from lippmann.terminal.output import Output

if TYPE_CHECKING:
    from service.schemas.job import Job


def submit(
    job_file: Annotated[str, typer.Argument(metavar="JOB.json", help="The job file, or - to read it from stdin.")],
    overrides: Overrides = None,
    watching: Annotated[bool, typer.Option("--watch", help="Watch the job until it ends.")] = False,
    no_cache: Annotated[
        bool, typer.Option("--no-cache", help="Render every tile, and store none in the render cache.")
    ] = False,
    webhook: Annotated[
        str | None,
        typer.Option(metavar="URL", help="A URL that gets a signed message when the job has ended (docs/webhooks.md)."),
    ] = None,
    *,
    output: Output,
    connection: Connection,
) -> None:
    """Submit a job from a job file (docs/job-file.md)."""
    from lippmann.job.old_names import current_job
    from lippmann.job.spec import parse_spec
    from lippmann.local.files.job import read_job

    job = read_job(job_file, [*(overrides or ()), *(["render.cache=false"] if no_cache else ())])
    parse_spec(job)  # An invalid job is refused at once, with or without a service, and old names are noted.
    old_names = current_job(job)[1]
    with connection.client(patience_s=RECONNECT_S if watching else 3.0) as client:
        made = client.submit(job, webhook=webhook)
        for note in made.notes:
            if note not in old_names:
                output.note(f"note: {note}")
        if watching:
            from lippmann.client.watch import watch_job

            output.note(f"{made.id} {made.status}")
            made = watch_job(client, made.id)
    _print_status(made, output)


def jobs(
    status: Annotated[str | None, typer.Option(help="List only the jobs with this status.")] = None,
    limit: Annotated[int, typer.Option(min=1, max=100_000, help="The largest number of jobs to list.")] = 20,
    *,
    output: Output,
    connection: Connection,
) -> None:
    """List the jobs, newest first, with the reason why each of them waits."""
    from lippmann.cli.text.jobs import job_table

    with connection.client() as client:
        found = list(client.jobs(status=status, limit=limit))
    output.result([job.model_dump(mode="json") for job in found], job_table(found))


def show(job_id: JobId, output: Output, connection: Connection) -> None:
    """Show a job, and why it waits if no task of it runs."""
    from lippmann.cli.text.jobs import job_text

    with connection.client() as client:
        job = client.job(job_id)
    output.result(job.model_dump(mode="json"), job_text(job))


def tasks(
    job_id: JobId,
    status: Annotated[str | None, typer.Option(help="List only the tasks with this status.")] = None,
    limit: Annotated[int, typer.Option(min=1, max=1_000_000, help="The largest number of tasks to list.")] = 100,
    *,
    output: Output,
    connection: Connection,
) -> None:
    """List the tasks of a job in order, with the reason why each of them waits."""
    from lippmann.cli.text.jobs import task_table

    with connection.client() as client:
        found = list(client.tasks(job_id, status=status, limit=limit))
    output.result([task.model_dump(mode="json") for task in found], task_table(found))


def watch(job_id: JobId, output: Output, connection: Connection) -> None:
    """Watch a job until it ends. The exit code is 0 when it is done and 1 when it failed or was cancelled."""
    from lippmann.client.watch import watch_job

    with connection.client(patience_s=RECONNECT_S) as client:
        job = watch_job(client, job_id)
    _print_status(job, output)


def fetch(
    job_id: JobId,
    out: OutputFolder = Path("out"),
    frames: Annotated[
        str | None, typer.Option(help="Fetch only the pictures of these frames, for example 1-48:2,60.")
    ] = None,
    masters: Annotated[bool, typer.Option("--masters", help="Fetch the EXR masters instead of PNG pictures.")] = False,
    *,
    output: Output,
    connection: Connection,
) -> None:
    """Fetch the pictures and outputs of a job. Files that are complete in the folder are not fetched again.

    If the job has not made everything, missing.json in the folder says what is missing and why, and the exit code is 5.
    """
    from lippmann.client.fetch import fetch_job, fetch_text
    from lippmann.client.missing import missing_text

    with connection.client(patience_s=RECONNECT_S) as client:
        result = fetch_job(client, job_id, out, frames=frames, masters=masters)
    data = {
        "folder": str(result.folder),
        "files": [str(path) for path in result.files],
        "brought": result.fetched,
        "bytes_brought": result.fetched_bytes,
        "missing": asdict(result.missing) if result.missing else None,
    }
    output.result(data, fetch_text(result))
    if result.missing:
        output.note(missing_text(result.missing, out))
        raise typer.Exit(ExitCode.INCOMPLETE)


def link(
    job_id: JobId,
    artifact: Annotated[
        str, typer.Argument(metavar="FILE", help="The name of a file of the job, such as video/views.mp4.")
    ],
    hours: Annotated[
        float | None, typer.Option(min=0.001, help="The hours until the link expires. By default a day.")
    ] = None,
    *,
    output: Output,
    connection: Connection,
) -> None:
    """Create a link with which anybody downloads one file of a job without a key, until the link expires."""
    with connection.client() as client:
        made = client.artifact_link(job_id, artifact, expires_in_s=None if hours is None else hours * 3600)
    output.note(f"The link is valid until {made.expires_at:%Y-%m-%d %H:%M:%S} UTC:")
    output.result(made.model_dump(mode="json"), made.url)


def cancel(job_id: JobId, output: Output, connection: Connection) -> None:
    """Cancel a job. Its finished frames and outputs are kept."""
    with connection.client() as client:
        _print_status(client.cancel(job_id), output)


def pause(job_id: JobId, output: Output, connection: Connection) -> None:
    """Pause a job. Running tasks finish, and no new task starts."""
    with connection.client() as client:
        _print_status(client.pause(job_id), output)


def resume(job_id: JobId, output: Output, connection: Connection) -> None:
    """Resume a paused job."""
    with connection.client() as client:
        _print_status(client.resume(job_id), output)


def retry(job_id: JobId, output: Output, connection: Connection) -> None:
    """Run the failed and cancelled tasks of an ended job again."""
    with connection.client() as client:
        _print_status(client.retry(job_id), output)


def repair(job_id: JobId, output: Output, connection: Connection) -> None:
    """Verify every file of an ended job, and make the missing and damaged ones again."""
    with connection.client() as client:
        _print_status(client.repair(job_id), output)


def skip(
    job_id: JobId,
    frames: Annotated[
        str | None,
        typer.Option(help="The frames to leave out, for example 7,12-14. By default, those that failed."),
    ] = None,
    *,
    output: Output,
    connection: Connection,
) -> None:
    """Leave frames of a failed or cancelled job out and continue it; its outputs are made without them.

    A retry of the job brings them back.
    """
    from lippmann.job.frames import parse_frames

    with connection.client() as client:
        _print_status(client.skip(job_id, parse_frames(frames) if frames else None), output)


def _print_status(job: Job, output: Output) -> None:
    output.result(job.model_dump(mode="json"), f"{job.id} {job.status}")
