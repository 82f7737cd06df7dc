"""The guard of artifacts: what a request reads is verified, and what is damaged is made again.

The size is compared before every answer. The content of a small artifact is verified before the first byte is sent. A
large one is verified while it is sent, and its last chunk is kept back until it is known to be whole, so that no client
receives a complete file that is damaged, and no byte is read twice for it. A part of a large artifact is sent at once,
and the whole is verified in the background. A verified artifact is remembered by its entity tag for `REMEMBERED_S`.
"""

from __future__ import annotations

import threading
import time
from collections import OrderedDict
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass

import structlog

from lippmann.digest import Digest, DigestWriter
from lippmann.errors import ArtifactBroken, ArtifactMissing, LippmannError
from lippmann.job.states import TaskStatus
from lippmann.plan import artifact_names as names
from lippmann.plan.artifact_store import ArtifactInfo, ArtifactStore
from service.db.engine import Database
from service.db.tables import Task
from service.errors import ArtifactRepairing
from service.jobs.artifact_repair import find_maker, repair_artifact
from service.jobs.state_machine import find_job
from service.jobs.verification import Damage, examine, reported, size_damage

SMALL_BYTES = 32 * 1024 * 1024
"""The size up to which the content is verified before an answer: about 20 ms of SHA-256."""
REMEMBERED_S = 3600.0
"""The time after which an artifact is verified again."""
REMEMBERED = 20_000

log = structlog.get_logger("service.artifact_guard")


@dataclass(frozen=True)
class FoundArtifact:
    """An artifact that may be read."""

    info: ArtifactInfo
    digest: Digest | None
    """The digest that its task reported; None if it is unknown."""


class ArtifactGuard:
    """Verifies artifacts for requests; for any number of threads."""

    def __init__(
        self, database: Database, store: ArtifactStore, *, steady: Callable[[], float] = time.monotonic
    ) -> None:
        self._database = database
        self._store = store
        self._steady = steady
        self._whole: OrderedDict[tuple[str, str], float] = OrderedDict()
        self._lock = threading.Lock()
        self._background = ThreadPoolExecutor(max_workers=1, thread_name_prefix="artifact-guard")

    def close(self) -> None:
        """End the thread of the background."""
        self._background.shutdown(wait=False, cancel_futures=True)

    def check(self, job_id: str, name: str, *, whole: bool = False, content: bool = True) -> FoundArtifact | None:
        """Verify an artifact before it is read: its size, and its content if it is small.

        Return what is known of it; None if it does not exist and is not made yet.

        Parameters
        ----------
        name
            The name below the job.
        whole
            True to verify the content also of a large artifact, because all of it is read anyway.
        content
            False to verify the size only, because whoever reads the artifact compares its digest.

        Raises
        ------
        ArtifactRepairing
            If the artifact is missing or damaged, and the farm makes it again.
        ArtifactMissing, ArtifactBroken
            If the artifact is missing or damaged, and the farm does not make it again by itself.
        """
        task = self._task(job_id, name)
        is_done = task is not None and task.status is TaskStatus.DONE
        try:
            info = self._store.info(names.job_artifact(job_id, name))
        except ArtifactMissing as error:
            if is_done:
                message = f"{name}: expected an artifact, got nothing there"
                raise self.damaged(job_id, name, Damage.MISSING, message) from error
            if task is not None and task.repairs:
                raise ArtifactRepairing(f"{name} was damaged, and the farm makes it again") from error
            return None
        if task is None or not is_done:
            return FoundArtifact(info, None)
        expected = reported(task).get(name)
        wrong = size_damage(name, info.size, expected)
        if wrong is not None:
            raise self.damaged(job_id, name, Damage.SIZE, wrong)
        if content and expected is not None and (whole or expected.size <= SMALL_BYTES):
            self._verify(job_id, name, expected, info.etag)
        return FoundArtifact(info, expected)

    def digest(self, job_id: str, name: str) -> Digest | None:
        """Return the digest that the task of an artifact reported; None if it is unknown."""
        task = self._task(job_id, name)
        return reported(task).get(name) if task is not None and task.status is TaskStatus.DONE else None

    @contextmanager
    def reading(self, job_id: str, name: str) -> Iterator[None]:
        """Verify all of an artifact before it is decoded; one that cannot be decoded is damaged, too.

        Raises
        ------
        ArtifactMissing, ArtifactRepairing, ArtifactBroken
            See `check`.
        """
        self.check(job_id, name, whole=True)
        try:
            yield
        except ArtifactBroken as error:
            raise self.damaged(job_id, name, Damage.CONTENT, error.message) from error

    def verified_chunks(
        self, job_id: str, name: str, expected: Digest | None, chunks: Iterator[bytes], *, etag: str
    ) -> Iterator[bytes]:
        """Yield the chunks of a whole artifact; if its digest is known, the last one only if its content is whole.

        Raises
        ------
        ArtifactRepairing, ArtifactBroken
            In place of the last chunk, if the artifact is damaged.
        """
        if expected is None or self._is_whole(job_id, name, etag):
            yield from chunks
            return
        written, kept = DigestWriter(), b""
        for chunk in chunks:
            written.update(chunk)
            if kept:
                yield kept
            kept = chunk
        if written.digest() != expected:
            raise self.damaged(job_id, name, Damage.CONTENT, f"{name}: expected the SHA-256 {expected.sha256}")
        self._remember(job_id, name, etag)
        yield kept

    def check_later(self, job_id: str, name: str, *, etag: str) -> None:
        """Verify an artifact in the background, of which a part is being sent."""
        if not self._is_whole(job_id, name, etag):
            self._background.submit(self._check_quietly, job_id, name)

    def damaged(self, job_id: str, name: str, damage: Damage, message: str) -> Exception:
        """Have a damaged artifact made again, and return the error that says so, or why it is not made again."""
        cannot_be_read = damage is not Damage.MISSING
        if repair_artifact(self._database, self._store, job_id, name, cannot_be_read=cannot_be_read):
            log.info("a damaged artifact is made again", job=job_id, artifact=name, damage=damage, reason=message)
            return ArtifactRepairing(f"{name} is {_WORDS[damage]}, and the farm makes it again")
        log.warning("a damaged artifact is not made again", job=job_id, artifact=name, damage=damage, reason=message)
        if damage is Damage.MISSING:
            return ArtifactMissing(message)
        return ArtifactBroken(f"{message}; the action `repair` of the job makes it again")

    def _check_quietly(self, job_id: str, name: str) -> None:
        try:
            self.check(job_id, name, whole=True)
        except (LippmannError, ArtifactRepairing):
            return  # The next request for the artifact is answered with it.
        except Exception as error:  # the outermost frame of the thread
            log.warning("an artifact could not be verified", job=job_id, artifact=name, error=repr(error))

    def _verify(self, job_id: str, name: str, expected: Digest, etag: str) -> None:
        if self._is_whole(job_id, name, etag):
            return
        found = examine(self._store, job_id, name, expected)
        if found is not None:
            raise self.damaged(job_id, name, *found)
        self._remember(job_id, name, etag)

    def _task(self, job_id: str, name: str) -> Task | None:
        with self._database.reading() as session:
            return find_maker(session, find_job(session, job_id), name)

    def _is_whole(self, job_id: str, name: str, etag: str) -> bool:
        key = (names.job_artifact(job_id, name), etag)
        with self._lock:
            return self._steady() - self._whole.get(key, float("-inf")) < REMEMBERED_S

    def _remember(self, job_id: str, name: str, etag: str) -> None:
        with self._lock:
            key = (names.job_artifact(job_id, name), etag)
            self._whole[key] = self._steady()
            self._whole.move_to_end(key)
            while len(self._whole) > REMEMBERED:
                self._whole.popitem(last=False)


_WORDS = {Damage.MISSING: "missing", Damage.SIZE: "not whole", Damage.CONTENT: "damaged"}
