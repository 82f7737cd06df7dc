"""The environment of a worker: store, scratch folders, POV-Ray and its sandbox, the connection to the service."""

from __future__ import annotations

import contextlib
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cache, cached_property
from importlib.metadata import version as package_version
from pathlib import Path
from typing import TypeVar

import structlog
from pydantic import BaseModel, ValidationError

from lippmann.errors import LippmannError, WorkerOutdated
from lippmann.job.messages.orders import Order
from lippmann.job.resolved import ResolvedJob, StoredPlan
from lippmann.plan import artifact_names as names
from lippmann.plan.artifact_store import ArtifactStore
from lippmann.private_files import make_passable
from povtemplates.catalogue import scene_folders
from worker.report import BrokerClient
from worker.sandbox.bundle import digest_of, pack_folder
from worker.sandbox.detect import detect_once
from worker.sandbox.log import AttemptLog
from worker.sandbox.sandbox import Sandbox
from worker.settings import WorkerSettings
from worker.store.opening import open_store
from worker.tasks.attempts.live_log import stored_while_it_grows
from worker.tasks.scenes.bundle_folder import unpacked_bundle
from worker.tasks.scenes.folder_lock import folder_lock

log = structlog.get_logger()

Sheet = TypeVar("Sheet", bound=BaseModel)


@dataclass(frozen=True)
class Workplace:
    """Everything outside the process that an attempt uses."""

    settings: WorkerSettings
    sandbox: Sandbox
    announce: Callable[[str], None] = lambda attempt: None
    """Announces that an attempt will soon need its core no longer; see `worker.handover`."""
    own_files: bool = False
    """True if the scenes are files of the person who runs the command, who may do without a sandbox."""

    @cached_property
    def store(self) -> ArtifactStore:
        """The store of the artifacts. Its first use opens it, so that an attempt reports a store that is away."""
        return open_store(self.settings, reserve_bytes=self.settings.disk_reserve_bytes)

    @cached_property
    def broker(self) -> BrokerClient:
        """The connection to the service."""
        settings = self.settings
        return BrokerClient(settings.broker, settings.worker_name, settings.instance, seals=settings.seals)

    def stopping(self) -> bool:
        """Return whether this worker is being shut down."""
        return self.settings.stopping_file.exists()

    def job_sheet(self, job_id: str) -> ResolvedJob:
        """Return the job as the service stored it.

        Raises
        ------
        WorkerOutdated
            If it has a field or a value that only a newer version knows. Without it, other pixels would be rendered.
        """
        return self._sheet(ResolvedJob, job_id, names.JOB_FILE)

    def plan_sheet(self, job_id: str) -> StoredPlan:
        """Return the plan of a job as the service stored it; see `job_sheet`."""
        return self._sheet(StoredPlan, job_id, names.PLAN_FILE)

    def _sheet(self, kind: type[Sheet], job_id: str, file: str) -> Sheet:
        try:
            return kind.model_validate_json(self.store.get_bytes(names.job_artifact(job_id, file)))
        except ValidationError as error:
            problem, *_ = error.errors()
            if problem["type"] == "json_invalid":
                raise
            where = ".".join(map(str, problem["loc"]))
            mine = package_version("lippmann")
            raise WorkerOutdated(f"this worker is of version {mine} and does not know {where} of {file}") from error

    def sandbox_for(self, digest: str) -> Sandbox:
        """Return the sandbox for a scene bundle: the mode `none` refuses it unless it is built in or one's own.

        The digest names the content, so an uploaded scene cannot pass for a built-in one.
        """
        return replace(self.sandbox, allow_none=self.own_files or digest in builtin_digests())

    @contextlib.contextmanager
    def bundle(self, digest: str) -> Iterator[Path]:
        """Yield the folder with a scene bundle's files; see `unpacked_bundle`."""
        limit_bytes = self.settings.bundles_bytes
        with unpacked_bundle(self.store, digest, self.settings.bundles_dir, limit_bytes=limit_bytes) as folder:
            yield folder

    @contextlib.contextmanager
    def task_folder(self) -> Iterator[Path]:
        """Yield an empty folder that is removed afterwards, by `sweep_attempts` if the process is killed meanwhile."""
        root = self.settings.attempts_dir
        make_passable(root)
        with contextlib.ExitStack() as stack:
            with folder_lock(root, wait=True):  # a folder that is not locked yet is not swept
                name = stack.enter_context(tempfile.TemporaryDirectory(dir=root, ignore_cleanup_errors=True))
                folder = Path(name).resolve()
                stack.enter_context(folder_lock(folder))
            yield folder


@cache
def builtin_digests() -> frozenset[str]:
    """Return the digests of the bundles of the built-in scenes."""
    return frozenset(digest_of(pack_folder(folder)) for folder in scene_folders().values())


def workplace(
    settings: WorkerSettings, announce: Callable[[str], None] = lambda attempt: None, *, own_files: bool = False
) -> Workplace:
    """Return the workplace for some settings, with the store in their data folder.

    Parameters
    ----------
    own_files
        True if the scenes are files of the person who runs the command.

    Raises
    ------
    SandboxMissing
        If the sandbox that the settings require does not work here.
    """
    return Workplace(
        settings=settings,
        sandbox=detect_once(settings.sandbox, cgroup=settings.cgroup),
        announce=announce,
        own_files=own_files,
    )


log = structlog.get_logger()


@contextlib.contextmanager
def kept_log(place: Workplace, order: Order, folder: Path) -> Iterator[AttemptLog]:
    """Yield an attempt's log, which is stored while it grows and afterwards, after success and failure alike."""
    path = folder.with_name(f"{folder.name}.txt")
    name = names.log_name(order.kind, order.frame, order.tile, order.output, order.attempt_number)
    stored_name = names.job_artifact(order.job_id, name)
    try:
        with AttemptLog(path) as attempt_log, stored_while_it_grows(place.store, stored_name, path):
            yield attempt_log
    finally:
        # A log that cannot be stored must not hide how the attempt ended.
        try:
            place.store.put_file(stored_name, path)
        except (LippmannError, OSError) as error:
            log.warning("attempt log not stored", name=name, error=str(error))
        path.unlink(missing_ok=True)
