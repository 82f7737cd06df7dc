"""The artifacts of a backup: files below one folder, linked where the store is on the same file system, else copied.

The store never changes an artifact in place, so a link keeps the content that it had when the backup was made.
"""

from __future__ import annotations

import errno
import os
import shutil
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from lippmann.errors import ArtifactMissing
from lippmann.plan.artifact_store import ArtifactStore
from service.backup.files import check_lines, digest_of, read_lines, write_lines
from service.backup.manifest import ARTIFACT_LIST, ARTIFACTS, ArtifactPart, BackupBroken

SCENES = "scenes"
"""The prefix of the scene bundles."""
_NO_LINK = frozenset({errno.EXDEV, errno.EPERM, errno.EMLINK, errno.EOPNOTSUPP})


def dump_artifacts(store: ArtifactStore, backup: Path, job_ids: Iterable[str], *, link: bool) -> ArtifactPart:
    """Write the artifacts of jobs and all scene bundles into a backup.

    Artifacts that are newer than the snapshot of the database do no harm, since the name of an artifact is a function
    of its content's definition. An artifact that is deleted meanwhile is left out.
    """
    totals = [0, 0]

    def entries() -> Iterator[Any]:
        for prefix in (SCENES, *job_ids):
            for info in store.list(prefix):
                entry = _dump(store, backup, info.name, link)
                if entry is not None:
                    totals[0], totals[1] = totals[0] + 1, totals[1] + entry[1]
                    yield entry

    written = write_lines(backup / ARTIFACT_LIST, entries())
    return ArtifactPart(list=written, count=totals[0], bytes=totals[1])


def check_artifacts(backup: Path, part: ArtifactPart) -> None:
    """Check that every artifact of a backup is complete.

    Raises
    ------
    BackupBroken
        If one is missing, truncated or altered, or has a name that leads out of the backup.
    """
    check_lines(backup / ARTIFACT_LIST, part.list)
    for name, size, sha256 in _entries(backup, part):
        path = _path(backup, name)
        if not path.is_file() or path.stat().st_size != size or digest_of(path) != sha256:
            raise BackupBroken(
                f"{path}: expected {size} bytes as they were backed up, got others; the backup is damaged"
            )


def load_artifacts(store: ArtifactStore, backup: Path, part: ArtifactPart) -> None:
    """Store the artifacts of a backup."""
    for name, _, sha256 in _entries(backup, part):
        try:
            stored = store.put_file(name, _path(backup, name))
        except ValueError as error:
            raise BackupBroken(f"{backup}: {error}") from error
        if stored.sha256 != sha256:
            raise BackupBroken(f"{backup / ARTIFACTS / name}: expected the content that was checked, got another")


def _dump(store: ArtifactStore, backup: Path, name: str, link: bool) -> list[Any] | None:
    path = backup / ARTIFACTS / name
    path.parent.mkdir(parents=True, exist_ok=True)
    try:
        with store.local_path(name) as source:
            _link_or_copy(source, path, link)
    except (ArtifactMissing, FileNotFoundError):
        return None
    return [name, path.stat().st_size, digest_of(path)]


def _link_or_copy(source: Path, path: Path, link: bool) -> None:
    if link:
        try:
            os.link(source, path)
            return
        except OSError as error:
            if error.errno not in _NO_LINK:
                raise
    shutil.copyfile(source, path)


def _entries(backup: Path, part: ArtifactPart) -> Iterator[tuple[str, int, str]]:
    for entry in read_lines(backup / ARTIFACT_LIST, part.list):
        if not (isinstance(entry, list) and [type(value) for value in entry] == [str, int, str]):
            raise BackupBroken(f"{backup / ARTIFACT_LIST}: expected name, size and digest, got {entry!r}")
        yield entry[0], entry[1], entry[2]


def _path(backup: Path, name: str) -> Path:
    """Return the file of an artifact; neither a name nor a link leads out of the backup."""
    root = backup.resolve() / ARTIFACTS
    path = root / name
    if any(part in ("", ".", "..") for part in name.split("/")) or path.resolve() != path:
        raise BackupBroken(f"{backup}: expected the name of an artifact, got {name!r}")
    return path
