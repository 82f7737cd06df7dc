"""Jobs: submit, list, show, watch, their tasks and logs."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Annotated, TypeVar

import typer

from lippmann.cli.exit_codes import ExitCode
from lippmann.cli.options import RECONNECT_S, JobId, JobIds, JobStatusName, Overrides, TaskStatusName
from lippmann.cli.several import act_on_each, status_of
from lippmann.client.connection import Connection
from lippmann.terminal.output import Output

Shape = TypeVar("Shape")

if TYPE_CHECKING:
    from lippmann.client.client import Client
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
        typer.Option(metavar="URL", help="The URL that gets a signed message when the job has ended."),
    ] = None,
    *,
    output: Output,
    connection: Connection,
) -> None:
    """Submit a job from a job file. `lippmann docs job-file` describes its fields."""
    from lippmann.job.fields.old_names import current_job
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
            output.note(f"{made.id} {made.status}")
            made = _watch(client, made.id, output, noted=(*old_names, *made.notes))
    output.result(*status_of(made))


def jobs(
    status: Annotated[JobStatusName | None, typer.Option(help="List only the jobs with this status.")] = None,
    limit: Annotated[int, typer.Option(min=1, max=100_000, help="The largest number of jobs to list.")] = 20,
    *,
    output: Output,
    connection: Connection,
) -> None:
    """List the jobs, newest first. Each has the reason why it waits."""
    from lippmann.cli.text.jobs import job_table

    with connection.client() as client:
        found = _first(client.jobs(status=status, limit=limit + 1), limit, "newest jobs", output)
    output.result([job.model_dump(mode="json") for job in found], job_table(found))


def show(job_ids: JobIds, output: Output, connection: Connection) -> None:
    """Show jobs, and why they wait."""
    from lippmann.cli.text.jobs import job_text

    with connection.client() as client:

        def shown(job_id: str) -> tuple[object, str]:
            job = client.job(job_id)
            return job.model_dump(mode="json"), job_text(job) + ("\n" if len(job_ids) > 1 else "")

        act_on_each(job_ids, shown, output)


def tasks(
    job_id: JobId,
    status: Annotated[TaskStatusName | None, typer.Option(help="List only the tasks with this status.")] = None,
    limit: Annotated[int, typer.Option(min=1, max=1_000_000, help="The largest number of tasks to list.")] = 100,
    *,
    output: Output,
    connection: Connection,
) -> None:
    """List the tasks of a job. Each has the reason why it waits or failed."""
    from lippmann.cli.text.jobs import task_table

    with connection.client() as client:
        found = _first(client.tasks(job_id, status=status, limit=limit + 1), limit, "first tasks", output)
    output.result([task.model_dump(mode="json") for task in found], task_table(found))


def _first(items: Iterator[Shape], limit: int, what: str, output: Output) -> list[Shape]:
    """Return the first items, and say that there are more."""
    found = list(items)
    if len(found) > limit:
        output.note(f"These are the {limit} {what}; --limit and --status list others.")
    return found[:limit]


def logs(
    job_id: JobId,
    follow: Annotated[
        bool, typer.Option("--follow", help="Print further logs as attempts end, until the job ends.")
    ] = False,
    task: Annotated[
        str | None,
        typer.Option(metavar="TASK", help="Print only the log of this task, whose id `lippmann tasks` lists."),
    ] = None,
    status: Annotated[
        TaskStatusName | None, typer.Option(help="Print only the logs of the tasks with this status.")
    ] = None,
    limit: Annotated[
        int, typer.Option(min=1, max=1_000_000, help="The largest number of logs without --follow.")
    ] = 100,
    *,
    output: Output,
    connection: Connection,
) -> None:
    """Print the logs of the tasks of a job. Each is that of the latest attempt, with the messages of POV-Ray."""
    from lippmann.cli.text.jobs import log_data, log_text
    from lippmann.client.logs import follow_logs, read_logs

    kept, count = [], 0
    with connection.client(patience_s=RECONNECT_S if follow else 3.0) as client, _job_goes_on(job_id, output):
        if follow:
            found = follow_logs(client, job_id, status=status, task_id=task)
        else:
            found = read_logs(client, job_id, status=status, task_id=task, limit=limit)
        for one in found:
            count += 1
            if output.as_json:
                kept.append(log_data(one))
            else:
                output.result(None, log_text(one))
    if output.as_json:
        output.result(kept, "")
    if not count:
        output.note("No attempt has ended yet, so there is no log.")
    elif count == limit and not follow:
        output.note(f"These are the first {limit} logs; --limit, --status and --task select others.")


def watch(job_id: JobId, output: Output, connection: Connection) -> None:
    """Watch a job until it ends. The exit code is 0 when it is done and 1 when it failed or was cancelled."""
    with connection.client(patience_s=RECONNECT_S) as client:
        job = _watch(client, job_id, output)
    output.result(*status_of(job))


def _watch(client: Client, job_id: str, output: Output, *, noted: Collection[str] = ()) -> Job:
    """Watch a job until it ends, and print its notes but those `noted`: the probe of the scene adds some."""
    from lippmann.client.watch import watch_job

    with _job_goes_on(job_id, output):
        job = watch_job(client, job_id)
    for note in job.notes:
        if note not in noted:
            output.note(f"note: {note}")
    output.note(f"`lippmann fetch {job_id}` brings its files to out/{job_id}/.")
    return job


@contextmanager
def _job_goes_on(job_id: str, output: Output) -> Iterator[None]:
    """End the command after Ctrl-C, and say that the job goes on."""
    try:
        yield
    except KeyboardInterrupt:
        output.note(f"The job goes on. `lippmann watch {job_id}` comes back to it, `lippmann cancel {job_id}` ends it.")
        raise typer.Exit(ExitCode.INTERRUPTED) from None
