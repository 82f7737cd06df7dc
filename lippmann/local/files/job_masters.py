"""Masters of a job, fetched into a temporary folder for a command."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from lippmann.errors import BadInput
from lippmann.job.rendering.channels import stored_channels
from lippmann.plan import artifact_names as names
from lippmann.terminal.progress import ProgressLine

if TYPE_CHECKING:
    from lippmann.client import Client
    from service.schemas.job import Job


@contextmanager
def job_masters(
    client: Client, job: Job, frames: Sequence[int], *, depth: bool = False, channels: bool = False
) -> Iterator[Path]:
    """Yield a temporary folder with the orthoscopic masters of some frames, laid out as by `fetch --masters`.

    Parameters
    ----------
    client
        The client of the service.
    job
        The job.
    frames
        The numbers of the frames.
    depth
        True to fetch the depth of these frames too, if the job asked for it.
    channels
        True to fetch their other channels too, if the job asked for some.

    Raises
    ------
    BadInput
        If the job has no such frame; nothing is fetched then.
    """
    unknown = [frame for frame in frames if frame not in job.spec.frame_numbers]
    if unknown:
        raise BadInput(f"expected a frame of job {job.id}, {job.spec.frames}, got {unknown[0]}")
    wanted = [names.orthoscopic_name(frame) for frame in frames]
    if depth and job.spec.capture.depth:
        wanted += [names.depth_name(frame) for frame in frames]
    if channels and stored_channels(job.spec.capture):
        wanted += [names.channels_name(frame) for frame in frames]
    with tempfile.TemporaryDirectory(prefix="lippmann-masters-") as folder:
        with ProgressLine(f"fetch {job.id}") as line:
            for place, name in enumerate(wanted):
                client.download(job.id, name, Path(folder) / name)
                line.show((place + 1) / len(wanted), name)
        yield Path(folder)
