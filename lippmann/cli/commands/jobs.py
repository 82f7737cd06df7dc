"""Jobs: submit, list, show, watch, fetch, move."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from lippmann.cli.options import DATA_DIR, RECONNECT_S, AsJson, DataDir, JobId, Key, Overrides, Url
from lippmann.client.connection import Connection
from lippmann.terminal.output import Talk

if TYPE_CHECKING:
    from service.schemas.job import Job


def submit(
    job_file: Annotated[str, typer.Argument(metavar="JOB.json", help="The job file; - for stdin.")],
    overrides: Overrides = None,
    watching: Annotated[bool, typer.Option("--watch", help="Watch it until it ends.")] = False,
    as_json: AsJson = False,
    url: Url = None,
    key: Key = None,
    data_dir: DataDir = DATA_DIR,
) -> None:
    """Submit a job: a file as in docs/job-file.md, single fields set anew with --set."""
    from lippmann.job.spec import parse_spec
    from lippmann.local.files.job import read_job

    job = read_job(job_file, overrides or ())
    parse_spec(job)  # what is wrong is said at once, with or without a service
    with Connection(url, key, data_dir).client(patience_s=RECONNECT_S if watching else 3.0) as client:
        made = client.submit(job)
        for note in made.notes:
            Talk(as_json).note(f"note: {note}")
        if watching:
            from lippmann.client.watch import follow_job

            Talk(as_json).note(f"{made.id} {made.status}")
            made = follow_job(client, made.id)
    _say_moved(made, as_json)


def jobs(
    status: Annotated[str | None, typer.Option(help="Only jobs of this status.")] = None,
    limit: Annotated[int, typer.Option(min=1, max=100_000, help="At most so many.")] = 20,
    as_json: AsJson = False,
    url: Url = None,
    key: Key = None,
    data_dir: DataDir = DATA_DIR,
) -> None:
    """List jobs, newest first."""
    from lippmann.cli.text.jobs import job_table

    with Connection(url, key, data_dir).client() as client:
        found = list(client.jobs(status=status, limit=limit))
    Talk(as_json).result([job.model_dump(mode="json") for job in found], job_table(found))


def show(
    job_id: JobId, as_json: AsJson = False, url: Url = None, key: Key = None, data_dir: DataDir = DATA_DIR
) -> None:
    """Show a job."""
    from lippmann.cli.text.jobs import job_text

    with Connection(url, key, data_dir).client() as client:
        job = client.job(job_id)
    Talk(as_json).result(job.model_dump(mode="json"), job_text(job))


def watch(
    job_id: JobId, as_json: AsJson = False, url: Url = None, key: Key = None, data_dir: DataDir = DATA_DIR
) -> None:
    """Watch a job until it ends: exit code 0 when it is done, 1 when it failed or was cancelled."""
    from lippmann.client.watch import follow_job

    with Connection(url, key, data_dir).client(patience_s=RECONNECT_S) as client:
        job = follow_job(client, job_id)
    _say_moved(job, as_json)


def fetch(
    job_id: JobId,
    out: Annotated[Path, typer.Option(help="The folder to bring files to.")] = Path("out"),
    frames: Annotated[str | None, typer.Option(help="Only pictures of these frames: '1-48:2, 60'.")] = None,
    masters: Annotated[bool, typer.Option("--masters", help="The EXR masters instead of PNG.")] = False,
    as_json: AsJson = False,
    url: Url = None,
    key: Key = None,
    data_dir: DataDir = DATA_DIR,
) -> None:
    """Bring a job's pictures and videos here; what is here already, and whole, is passed over."""
    from lippmann.client.fetch import fetch_job, haul_text

    with Connection(url, key, data_dir).client(patience_s=RECONNECT_S) as client:
        haul = fetch_job(client, job_id, out, frames=frames, masters=masters)
    data = {"folder": str(haul.folder), "files": [str(path) for path in haul.files], "brought": haul.brought,
            "bytes_brought": haul.bytes_brought}  # fmt: skip
    Talk(as_json).result(data, haul_text(haul))


def cancel(
    job_id: JobId, as_json: AsJson = False, url: Url = None, key: Key = None, data_dir: DataDir = DATA_DIR
) -> None:
    """End a job; what is done stays."""
    _move("cancel", job_id, as_json, url, key, data_dir)


def pause(
    job_id: JobId, as_json: AsJson = False, url: Url = None, key: Key = None, data_dir: DataDir = DATA_DIR
) -> None:
    """Let nothing new of a job go out; what runs ends."""
    _move("pause", job_id, as_json, url, key, data_dir)


def resume(
    job_id: JobId, as_json: AsJson = False, url: Url = None, key: Key = None, data_dir: DataDir = DATA_DIR
) -> None:
    """Let a paused job go on."""
    _move("resume", job_id, as_json, url, key, data_dir)


def retry(
    job_id: JobId, as_json: AsJson = False, url: Url = None, key: Key = None, data_dir: DataDir = DATA_DIR
) -> None:
    """Let what failed of an ended job run again."""
    _move("retry", job_id, as_json, url, key, data_dir)


def _move(
    move: Literal["cancel", "pause", "resume", "retry"],
    job_id: str,
    as_json: bool,
    url: str | None,
    key: str | None,
    data_dir: Path,
) -> None:
    with Connection(url, key, data_dir).client() as client:
        job = {"cancel": client.cancel, "pause": client.pause, "resume": client.resume, "retry": client.retry}[move](
            job_id
        )
    _say_moved(job, as_json)


def _say_moved(job: Job, as_json: bool) -> None:
    Talk(as_json).result(job.model_dump(mode="json"), f"{job.id} {job.status}")
