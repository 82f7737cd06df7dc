"""Remove from the scratch folder of a worker what killed attempts left, and what nobody uses any more."""

from __future__ import annotations

import contextlib
import errno
import shutil
import time
from collections.abc import Iterator
from pathlib import Path

import structlog

from worker.sandbox.results import remove_tree
from worker.settings import WorkerSettings
from worker.tasks.scenes.bundle_folder import remove_bundle
from worker.tasks.scenes.folder_lock import folder_lock

log = structlog.get_logger()

BUNDLE_KEPT_S = 14 * 86_400.0
"""An unpacked bundle that no attempt has used for this long is removed at the next start: twice the longest attempt."""

REMOVE_PAUSES_S = (0.1, 1.0, 5.0)
"""The pauses before a folder that is still written to is removed again."""


def sweep_scratch(settings: WorkerSettings) -> None:
    """Remove what killed workers left, and the bundles that no attempt has used for long."""
    sweep_attempts(settings)
    for bundle in filter(Path.is_dir, settings.bundles_dir.glob("*")):
        with _failure_is_logged(bundle), contextlib.suppress(BlockingIOError):
            if time.time() - bundle.stat().st_mtime > BUNDLE_KEPT_S:
                remove_bundle(bundle)


def sweep_attempts(settings: WorkerSettings) -> None:
    """Remove the folders and logs of attempts whose process died, and the bundles that it did not finish to unpack.

    What living processes use is locked, so several sweeps at the same time do no harm either.
    """
    _sweep_unlocked(settings.attempts_dir, "*")
    _sweep_unlocked(settings.bundles_dir, ".*")
    for log_file in settings.attempts_dir.glob("*.txt"):
        if not log_file.with_suffix("").exists():
            log_file.unlink(missing_ok=True)


def _sweep_unlocked(root: Path, pattern: str) -> None:
    for folder in filter(Path.is_dir, root.glob(pattern)):
        with _failure_is_logged(folder), contextlib.suppress(BlockingIOError), contextlib.ExitStack() as stack:
            with folder_lock(root, wait=True):
                stack.enter_context(folder_lock(folder))
            _remove(folder)


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


@contextlib.contextmanager
def _failure_is_logged(folder: Path) -> Iterator[None]:
    """Go on with the other folders when one cannot be removed, and log why; another worker may remove it first."""
    try:
        yield
    except FileNotFoundError:
        return
    except OSError as error:
        log.warning("scratch folder not removed", folder=str(folder), error=str(error))
