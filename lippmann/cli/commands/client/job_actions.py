"""The actions on jobs: cancel, pause, resume, retry, repair, skip frames, set the priority, and remove."""

from __future__ import annotations

from typing import Annotated

import typer

from lippmann.cli.options import JobIds
from lippmann.cli.several import act_on_each, status_of
from lippmann.client.connection import Connection
from lippmann.terminal.output import Output


def cancel(job_ids: JobIds, output: Output, connection: Connection) -> None:
    """Cancel jobs. Their finished frames and outputs are kept."""
    with connection.client() as client:
        act_on_each(job_ids, lambda job_id: status_of(client.cancel(job_id)), output)


def pause(job_ids: JobIds, output: Output, connection: Connection) -> None:
    """Pause jobs. Running tasks finish, and no new task starts."""
    with connection.client() as client:
        act_on_each(job_ids, lambda job_id: status_of(client.pause(job_id)), output)


def resume(job_ids: JobIds, output: Output, connection: Connection) -> None:
    """Resume paused jobs."""
    with connection.client() as client:
        act_on_each(job_ids, lambda job_id: status_of(client.resume(job_id)), output)


def retry(job_ids: JobIds, output: Output, connection: Connection) -> None:
    """Run the failed and cancelled tasks of ended jobs again."""
    with connection.client() as client:
        act_on_each(job_ids, lambda job_id: status_of(client.retry(job_id)), output)


def repair(job_ids: JobIds, output: Output, connection: Connection) -> None:
    """Make missing and damaged files of ended jobs again. Every file is verified first."""
    with connection.client() as client:
        act_on_each(job_ids, lambda job_id: status_of(client.repair(job_id)), output)


def skip(
    job_ids: JobIds,
    frames: Annotated[
        str | None,
        typer.Option(help="The frames to leave out, for example 7,12-14. By default, those that failed."),
    ] = None,
    *,
    output: Output,
    connection: Connection,
) -> None:
    """Leave frames of failed or cancelled jobs out. The jobs go on, and their outputs are made without these frames.

    A retry of a job brings them back.
    """
    from lippmann.cli.option_values import frames_of

    numbers = frames_of(frames)
    with connection.client() as client:
        act_on_each(job_ids, lambda job_id: status_of(client.skip(job_id, numbers)), output)


def priority(
    job_ids: JobIds,
    number: Annotated[
        int,
        typer.Argument(metavar="PRIORITY", min=0, max=100, help="The new priority, 0 to 100. A job starts with 50."),
    ],
    output: Output,
    connection: Connection,
) -> None:
    """Set the priority of jobs. Jobs with a higher priority are rendered first."""
    with connection.client() as client:

        def prioritise(job_id: str) -> tuple[object, str]:
            job = client.prioritise(job_id, number)
            return job.model_dump(mode="json"), f"{job.id} {job.status}, priority {job.priority}"

        act_on_each(job_ids, prioritise, output)


def remove(job_ids: JobIds, output: Output, connection: Connection) -> None:
    """Remove ended jobs and all their files from the farm. Cancel a job first if it still runs."""
    with connection.client() as client:

        def delete(job_id: str) -> tuple[object, str]:
            client.delete(job_id)
            return {"id": job_id, "removed": True}, f"{job_id} removed"

        act_on_each(job_ids, delete, output)
