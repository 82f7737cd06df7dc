"""The render cache as one attempt uses it: the tile is taken from the cache, or stored in it once it is rendered.

An entry has everything that a render leaves in a job: the tile, its depth, the .pov and the log. Its files are links to
those of the job that rendered it, and a hit links them into another job, so each job keeps its files when the entry is
deleted. Every file is verified by its digest before it is used; an entry that is damaged or incomplete is removed, and
the tile is rendered. Two equal tiles that are rendered at the same time are rendered twice.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import structlog
from pydantic import ValidationError

from lippmann.errors import ArtifactMissing, LippmannError, StoreFull, StoreUnavailable
from lippmann.job.messages.orders import Order
from lippmann.job.resolved import ResolvedJob
from lippmann.plan import artifact_names as names
from lippmann.plan.artifact_store import ArtifactStore, read_digest
from lippmann.plan.render_cache import ENTRY, LOG, POV, CacheEntry, entry_files, entry_folder, tile_key
from lippmann.plan.sampling import Tile
from worker.engines.choose import engine_of
from worker.tasks.attempts.artifacts import TaskArtifacts
from worker.tasks.attempts.workplace import Workplace, kept_log

log = structlog.get_logger()


@dataclass(frozen=True)
class TileCache:
    """The entry of the tile of an order, which may not exist."""

    place: Workplace
    order: Order
    artifacts: TaskArtifacts
    key: str
    files: Mapping[str, str]
    """The files of the entry, with their names below the job; the tile comes last."""

    def take(self) -> bool:
        """Give the job the files of the entry, and return whether there is a complete one.

        A repeated attempt takes nothing: the first one may have failed because of what it took.
        """
        if self.order.attempt_number > 1:
            return False
        found = self._entry()
        if found is None:
            return False
        try:
            for file in (*self.files, LOG):
                if read_digest(self._store, self._name(file)) != found.files.get(file):
                    self._remove("damaged")
                    return False
            self._give(found)
        except ArtifactMissing:
            self._remove("incomplete")
            return False
        self._store_entry(found)
        return True

    def keep(self) -> None:
        """Store what the attempt rendered as the entry; a store that refuses it costs a later render and no more."""
        log_name = names.log_name(self.order.kind, self.order.frame, self.order.tile, None, self.order.attempt_number)
        try:
            digests = {}
            for file, name in (*self.files.items(), (LOG, log_name)):
                artifact = names.job_artifact(self.order.job_id, name)
                digests[file] = self.artifacts.stored.get(name) or read_digest(self._store, artifact)
                self._store.link(artifact, self._name(file))
        except LippmannError as error:
            log.warning("tile not stored in the render cache", key=self.key, error=str(error))
            return
        assert self.order.frame is not None  # noqa: S101 - it was rendered
        self._store_entry(CacheEntry(job_id=self.order.job_id, frame=self.order.frame, files=digests))

    @property
    def _store(self) -> ArtifactStore:
        return self.place.store

    def _name(self, file: str) -> str:
        return f"{entry_folder(self.key)}/{file}"

    def _entry(self) -> CacheEntry | None:
        try:
            return CacheEntry.model_validate_json(self._store.get_bytes(self._name(ENTRY)))
        except ArtifactMissing:
            return None
        except ValidationError:
            self._remove("damaged")
            return None

    def _give(self, found: CacheEntry) -> None:
        """Link the files into the job, after a log that says where they come from."""
        with self.place.task_folder() as folder, kept_log(self.place, self.order, folder) as attempt_log:
            attempt_log.write(
                f"This tile comes from the render cache, entry {self.key}. It was rendered as a tile of frame"
                f" {found.frame} of the job {found.job_id}, and this is the log of that attempt:"
            )
            for line in self._store.get_bytes(self._name(LOG)).decode(errors="replace").splitlines():
                attempt_log.write(line)
            for file, name in self.files.items():
                if file == POV:
                    self._store.link(self._name(file), names.job_artifact(self.order.job_id, name))
                else:
                    self.artifacts.link(self._name(file), name, found.files[file])

    def _store_entry(self, entry: CacheEntry) -> None:
        try:
            self._store.put_bytes(self._name(ENTRY), entry.model_dump_json().encode())
        except (StoreFull, StoreUnavailable) as error:
            log.warning("entry of the render cache not stored", key=self.key, error=str(error))

    def _remove(self, why: str) -> None:
        log.warning("entry of the render cache removed", key=self.key, why=why)
        self._store.delete(entry_folder(self.key))


def tile_cache(
    place: Workplace, sheet: ResolvedJob, order: Order, tile: Tile, artifacts: TaskArtifacts
) -> TileCache | None:
    """Return the entry of a tile; None if the job uses no cache, or the scene reads the time of day."""
    if not sheet.spec.render.cache:
        return None
    engine = engine_of(sheet)
    with place.bundle(sheet.bundle) as unpacked:
        use = engine.scene_use(unpacked)
    if use.now:
        return None
    assert order.frame is not None  # noqa: S101 - the order is for a tile
    software = engine.software(place.settings.povray)
    key = tile_key(sheet, order.frame, tile, software, reads_clock=use.clock, reads_frames=use.frames)
    files = entry_files(sheet.spec, order.frame, tile, has_source=engine.has_source)
    return TileCache(place, order, artifacts, key, files)
