"""All files of an output in one zip, which is made while it is sent.

The files are stored as they are, so that the size is known before the first byte. A missing file is found before that.
A damaged one ends the transfer before its last bytes, so nobody receives a whole zip with a part of the files.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from zipstream import ZIP_STORED, ZipStream

from lippmann.digest import Digest
from lippmann.job.outputs.output import OutputOptions
from lippmann.job.spec import JobSpec
from lippmann.job.states import TaskStatus
from lippmann.plan import artifact_names as names
from lippmann.plan.artifact_store import ArtifactInfo, ArtifactStore
from service.db import tasks as task_rows
from service.db.engine import Database
from service.errors import NotFound
from service.jobs.artifact_guard import ArtifactGuard
from service.jobs.state_machine import find_job
from service.jobs.verification import Damage, expected_artifacts, reported


@dataclass(frozen=True)
class Archive:
    """A zip that is made while it is read, once."""

    size: int
    """The size of the whole zip in bytes."""
    chunks: Iterator[bytes]


def find_archive(database: Database, store: ArtifactStore, guard: ArtifactGuard, job_id: str, name: str) -> Archive:
    """Return the zip of an output of a job: its folder or its video, and its sidecar.

    Parameters
    ----------
    name
        The file name of the output, such as `view_grid.png`.

    Raises
    ------
    NotFound
        If there is no such job or output, or the output is not made yet.
    ArtifactMissing, ArtifactRepairing, ArtifactBroken
        If a file of the output is missing or too short.
    """
    output, expected = _expected(database, store, job_id, name)
    top = names.output_folder(output).partition("/")[0]
    listed = {info.name: info for info in store.list(names.job_artifact(job_id, top))}
    archive = ZipStream(compress_type=ZIP_STORED, sized=True)
    for file, digest in sorted(expected.items()):
        info = listed.get(names.job_artifact(job_id, file))
        if info is None:
            raise guard.damaged(job_id, file, Damage.MISSING, f"{file}: expected an artifact, got nothing there")
        if digest is not None and info.size != digest.size:
            raise guard.damaged(job_id, file, Damage.SIZE, f"{file}: expected {digest.size} bytes, got {info.size}")
        chunks = _chunks(store, guard, job_id, file, info, digest)
        archive.add(chunks, file.removeprefix(f"{top}/"), size=info.size)
    return Archive(len(archive), iter(archive))


def _expected(
    database: Database, store: ArtifactStore, job_id: str, name: str
) -> tuple[OutputOptions, Mapping[str, Digest | None]]:
    """Return an output that is made, and its files below the job with their digests where these are known."""
    with database.reading() as session:
        spec = find_job(session, job_id).parsed_spec
        output = _find_output(spec, name)
        task = next((task for task in task_rows.outputs(session, job_id) if task.output == name), None)
    if task is None or task.status is not TaskStatus.DONE:
        raise NotFound(f"the output {name!r} is not made yet")
    expected = expected_artifacts(spec, task)
    if not reported(task):  # an output of an earlier release
        listing = json.loads(store.get_bytes(names.job_artifact(job_id, names.sidecar_name(output))))
        expected |= dict.fromkeys(listing["files"])
    return output, expected


def _find_output(spec: JobSpec, name: str) -> OutputOptions:
    for output in spec.outputs:
        if output.file_name == name:
            return output
    known = ", ".join(output.file_name for output in spec.outputs)
    raise NotFound(f"there is no output {name[:100]!r} of this job; expected {f'one of {known}' if known else 'none'}")


def _chunks(
    store: ArtifactStore, guard: ArtifactGuard, job_id: str, file: str, info: ArtifactInfo, digest: Digest | None
) -> Iterator[bytes]:
    """Yield a file; the last chunk only if its content is whole. Nothing is opened before the first chunk is asked."""
    chunks = store.read_range(info.name, 0, info.size)
    yield from guard.verified_chunks(job_id, file, digest, chunks, etag=info.etag)
