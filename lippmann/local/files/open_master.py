"""Open the master that a command works on: a file, a frame of a folder, or a frame of a job, which is fetched."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from lippmann.client.connection import Connection
from lippmann.errors import BadInput
from lippmann.local.files.job_masters import job_masters
from lippmann.plan import artifact_names as names
from service.ids import is_job_id


@contextmanager
def open_master(
    source: Path, *, frame: int | None, connection: Connection, depth: bool = False, channels: bool = False
) -> Iterator[Path]:
    """Yield the path of an orthoscopic master; that of a job exists until the block ends.

    Parameters
    ----------
    source
        A master; a folder as `capture` and `fetch --masters` leave it; or the id of a job.
    frame
        The frame of the folder or the job; None for the first one.
    connection
        The service that has the job.
    depth
        True to fetch the depth of the job's frame too, if the job asked for it.
    channels
        True to fetch its other channels too, if the job asked for some.

    Raises
    ------
    BadInput
        If there is no such frame.
    """
    if not source.exists() and is_job_id(str(source)):
        with _of_job(str(source), frame, connection, depth=depth, channels=channels) as master:
            yield master
    elif source.is_dir():
        yield _of_folder(source, frame)
    elif frame is not None:
        raise BadInput(f"expected --frame with a job or a folder, got it with {source}")
    else:
        yield source


def _of_folder(folder: Path, frame: int | None) -> Path:
    if frame is not None:
        master = folder / names.orthoscopic_name(frame)
        if not master.is_file():
            raise BadInput(f"--frame: expected a frame of {folder}, got {frame}: there is no {master}")
        return master
    masters = sorted((folder / names.orthoscopic_name(1)).parent.glob("*.exr"))
    if not masters:
        raise BadInput(f"expected masters in {folder}/orthoscopic, got none")
    return masters[0]


@contextmanager
def _of_job(job_id: str, frame: int | None, connection: Connection, *, depth: bool, channels: bool) -> Iterator[Path]:
    with connection.client() as client:
        job = client.job(job_id)
        number = job.spec.frame_numbers[0] if frame is None else frame
        with job_masters(client, job, (number,), depth=depth, channels=channels) as folder:
            yield folder / names.orthoscopic_name(number)
