"""The artifacts of one attempt: what it reads is verified, and what it stores is recorded for the report."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from lippmann.digest import Digest, digest_of
from lippmann.errors import ArtifactBroken, ArtifactMissing, StoreUnavailable
from lippmann.job.messages.orders import Order
from lippmann.plan import artifact_names as names
from lippmann.plan.artifact_store import ArtifactStore, moving, read_digest
from worker.tasks.attempts.monitor import ProgressMonitor

CHUNK_BYTES = 1 << 20


class TaskArtifacts:
    """The artifacts of a job as one attempt reads and stores them, by their names below the job.

    Parameters
    ----------
    monitor
        The monitor of the attempt. It is asked whether to stop while bytes are moved, which is a sign of life.
    """

    def __init__(self, store: ArtifactStore, order: Order, monitor: ProgressMonitor) -> None:
        self.stored: dict[str, Digest] = {}
        """The digests of the artifacts that the task stores, by name."""
        self._store = store
        self._moved = monitor.should_stop
        self._job_id = order.job_id
        self._expected: Mapping[str, Digest] = order.digests
        self._verified: set[tuple[str, Path]] = set()

    def put(self, name: str, path: Path) -> None:
        """Store a file, completely or not at all, and record its digest."""
        self.stored[name] = self._store.put_file(self._full(name), path, moved=self._moved)

    def link(self, source: str, name: str, digest: Digest) -> None:
        """Store an artifact of the store, whose digest is known, under a name of the job as well."""
        self._store.link(source, self._full(name))
        self.stored[name] = digest

    def exists(self, name: str) -> bool:
        """Return whether an artifact exists, because an earlier attempt stored it; its digest is recorded then."""
        if not self._store.exists(self._full(name)):
            return False
        if name not in self.stored:
            self.stored[name] = read_digest(self._store, self._full(name), moved=self._moved)
        return True

    @contextmanager
    def opened(self, name: str) -> Iterator[Path]:
        """Yield the path of an artifact for reading, after a check of its digest if the order has one.

        Raises
        ------
        ArtifactMissing, ArtifactBroken
            If it does not exist or is damaged. The error names the artifact, also if it is raised while the caller
            reads the file.
        """
        with naming_artifact(name), self._store.local_path(self._full(name), moved=self._moved) as path:
            self._verify(name, path)
            yield path

    def _verify(self, name: str, path: Path) -> None:
        """Check the file that is read; of a bucket it is a copy, and a second one might differ."""
        expected = self._expected.get(name)
        if expected is None or (name, path) in self._verified:
            return
        try:
            size = path.stat().st_size
            if size != expected.size:
                raise ArtifactBroken(f"{name}: expected {expected.size} bytes, got {size}")
            with path.open("rb") as file:
                found = digest_of(moving(iter(lambda: file.read(CHUNK_BYTES), b""), self._moved))
        except OSError as error:
            raise StoreUnavailable(f"cannot read {name} of the store: {error.strerror}") from error
        if found != expected:
            raise ArtifactBroken(f"{name}: expected the SHA-256 {expected.sha256}, got {found.sha256}")
        self._verified.add((name, path))

    def _full(self, name: str) -> str:
        return names.job_artifact(self._job_id, name)


@contextmanager
def naming_artifact(name: str) -> Iterator[None]:
    """Add the name of an artifact to the errors of reading it, from which the service finds the task to repeat."""
    try:
        yield
    except (ArtifactBroken, ArtifactMissing) as error:
        if error.artifact is None:
            error.artifact = name
        raise
