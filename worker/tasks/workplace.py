"""The environment of a worker: store, scratch folders, POV-Ray and its sandbox, the connection to the service."""

from __future__ import annotations

import contextlib
import errno
import fcntl
import os
import shutil
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cache, cached_property
from importlib.metadata import version as package_version
from pathlib import Path
from typing import TypeVar

import structlog
from pydantic import BaseModel, ValidationError

from lippmann.errors import BundleError, LippmannError, Permanent, ScratchDamaged, WorkerOutdated
from lippmann.job.messages.orders import Order
from lippmann.job.resolved import ResolvedJob, StoredPlan
from lippmann.plan import artifact_names as names
from lippmann.plan.artifact_store import ArtifactStore
from lippmann.private_files import make_passable
from povtemplates.catalogue import scene_folders
from worker.report import BrokerClient
from worker.sandbox.bundle import digest_of, listing_of, pack_folder, unpack
from worker.sandbox.detect import detect
from worker.sandbox.log import AttemptLog
from worker.sandbox.results import remove_tree
from worker.sandbox.sandbox import Sandbox
from worker.settings import WorkerSettings
from worker.store.local import LocalStore

log = structlog.get_logger()

Sheet = TypeVar("Sheet", bound=BaseModel)

BUNDLE_KEPT_S = 14 * 86_400.0
"""An unpacked bundle that no attempt has used for this long is removed at the next start: twice the longest attempt."""


UNPACKED = "2"
"""The version of what `unpack` makes of a bundle. It is in the name of the folder, so that a worker of another version
unpacks the bundle anew."""

REMOVE_PAUSES_S = (0.1, 1.0, 5.0)
"""The pauses before a folder that is still written to is removed again."""


@dataclass(frozen=True)
class Workplace:
    """Everything outside the process that an attempt uses."""

    settings: WorkerSettings
    store: ArtifactStore
    sandbox: Sandbox
    announce: Callable[[str], None] = lambda attempt: None
    """Announces that an attempt will soon need its core no longer; see `worker.handover`."""
    own_files: bool = False
    """True if the scenes are files of the person who runs the command, who may do without a sandbox."""

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

        The digest names the content, so an uploaded scene cannot pass for one that comes with the project.
        """
        return replace(self.sandbox, allow_none=self.own_files or digest in builtin_digests())

    @contextlib.contextmanager
    def bundle(self, digest: str) -> Iterator[Path]:
        """Yield the folder with a scene bundle's files, unpacked once for all attempts.

        Raises
        ------
        BundleError
            If the bundle in the store has another content than its name says.
        ArtifactMissing
            If the store does not have the bundle.
        ScratchDamaged
            If files in the folder were removed or changed meanwhile. What was made of them counts for nothing, and an
            error is no fault of the scene. The next use unpacks the bundle again.
        OSError
            If it cannot be unpacked: only a folder that is complete is used.
        """
        folder = self.settings.bundles_dir / f"{digest}-{UNPACKED}"
        if not _is_whole(folder):
            self._unpack(digest, folder)
        os.utime(folder)
        number = folder.stat().st_ino
        try:
            yield folder.resolve()
        except Permanent as error:
            _check_whole(folder, number, error)
            raise
        _check_whole(folder, number)

    def _unpack(self, digest: str, folder: Path) -> None:
        make_passable(folder.parent)
        beside = Path(tempfile.mkdtemp(prefix=f".{digest[:8]}-", dir=folder.parent))
        try:
            data = self.store.get_bytes(names.bundle_name(digest))
            if digest_of(data) != digest:
                raise BundleError(f"expected the bundle {digest[:12]} in the store, got other content there")
            whole = beside / "whole"
            whole.mkdir()
            unpack(data, whole)
            if os.geteuid() == 0:  # Programs in the sandbox run as users of their own.
                for path in (whole, *whole.rglob("*")):
                    path.chmod(0o755 if path.is_dir() else 0o644)
            listing = beside / "listing"
            listing.write_text(listing_of(whole), encoding="utf-8")
            with folder_lock(folder.parent, wait=True):
                if _is_whole(folder):  # Another attempt was quicker.
                    return
                if folder.is_dir():
                    folder.rename(beside / "damaged")
                whole.rename(folder)
                listing.replace(_listing_file(folder))
        finally:
            shutil.rmtree(beside, ignore_errors=True)

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
    """Return the digests of the bundles of the scenes that come with the project."""
    return frozenset(digest_of(pack_folder(folder)) for folder in scene_folders().values())


def sweep_scratch(settings: WorkerSettings) -> None:
    """Remove what killed workers left, and the bundles that no attempt has used for long."""
    sweep_attempts(settings)
    for bundle in filter(Path.is_dir, settings.bundles_dir.glob("*")):
        with _failure_is_logged(bundle):
            if time.time() - bundle.stat().st_mtime > BUNDLE_KEPT_S:
                shutil.rmtree(bundle)
                _listing_file(bundle).unlink(missing_ok=True)


def sweep_attempts(settings: WorkerSettings) -> None:
    """Remove the folders and logs of attempts whose process died; the folders of living attempts are locked."""
    for folder in filter(Path.is_dir, settings.attempts_dir.glob("*")):
        with _failure_is_logged(folder), contextlib.suppress(BlockingIOError), contextlib.ExitStack() as stack:
            with folder_lock(settings.attempts_dir, wait=True):
                stack.enter_context(folder_lock(folder))
            _remove(folder)
    for log_file in settings.attempts_dir.glob("*.txt"):
        if not log_file.with_suffix("").exists():
            log_file.unlink(missing_ok=True)


def _remove(folder: Path) -> None:
    """Remove the folder of a dead attempt; its POV-Ray may write there until the kernel has ended it too."""
    for pause_s in REMOVE_PAUSES_S:
        try:
            return shutil.rmtree(folder)
        except RecursionError:  # a scene has made folders in folders
            return remove_tree(folder)
        except OSError as error:
            if error.errno != errno.ENOTEMPTY:
                raise
        time.sleep(pause_s)
    shutil.rmtree(folder)


def _listing_file(folder: Path) -> Path:
    """Return the file that lists what was unpacked into the folder of a bundle."""
    return folder.with_name(f"{folder.name}.json")


def _is_whole(folder: Path) -> bool:
    try:
        return listing_of(folder) == _listing_file(folder).read_text(encoding="utf-8")
    except OSError:
        return False


def _check_whole(folder: Path, number: int, error: Exception | None = None) -> None:
    """Check that a folder is whole, and still the one with this inode number: it may have been replaced."""
    if not _is_whole(folder) or folder.stat().st_ino != number:
        message = "files of the scene disappeared from the scratch folder of the worker while it used them"
        raise ScratchDamaged(message) from error


@contextlib.contextmanager
def _failure_is_logged(folder: Path) -> Iterator[None]:
    """Go on with the other folders when one cannot be removed, and log why; another worker may remove it first."""
    try:
        yield
    except FileNotFoundError:
        return
    except OSError as error:
        log.warning("scratch folder not removed", folder=str(folder), error=str(error))


@contextlib.contextmanager
def folder_lock(folder: Path, *, wait: bool = False) -> Iterator[None]:
    """Hold the lock of a folder; the kernel releases it when the process ends.

    Raises
    ------
    BlockingIOError
        If another process holds it, and this one does not `wait`.
    """
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
        try:
            yield
        finally:
            # Closing is not enough: a process that was forked meanwhile has the lock too.
            fcntl.flock(descriptor, fcntl.LOCK_UN)
    finally:
        os.close(descriptor)


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
        store=LocalStore(settings.artifacts_dir, reserve_bytes=settings.disk_reserve_bytes),
        sandbox=detect(settings.sandbox),
        announce=announce,
        own_files=own_files,
    )


log = structlog.get_logger()


@contextlib.contextmanager
def kept_log(place: Workplace, order: Order, folder: Path) -> Iterator[AttemptLog]:
    """Yield an attempt's log and store it afterwards, after success and failure alike."""
    path = folder.with_name(f"{folder.name}.txt")
    try:
        with AttemptLog(path) as attempt_log:
            yield attempt_log
    finally:
        name = names.log_name(order.kind, order.frame, order.tile, order.output, order.attempt_number)
        # A log that cannot be stored must not hide how the attempt ended.
        try:
            place.store.put_file(names.job_artifact(order.job_id, name), path)
        except (LippmannError, OSError) as error:
            log.warning("attempt log not stored", job=order.job_id, name=name, error=str(error))
        path.unlink(missing_ok=True)
