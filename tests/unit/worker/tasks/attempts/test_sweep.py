"""Scratch folders: those of living attempts are kept, those of dead ones are removed."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import pytest

from tests.needs import need_to_run
from tests.unit.worker.tasks.scenes.test_bundle_folder import with_bundle
from tests.waiting import ENOUGH_S
from worker.sandbox.bundle import unpack
from worker.settings import WorkerSettings
from worker.tasks.attempts.sweep import sweep_attempts, sweep_scratch
from worker.tasks.scenes import bundle_folder
from worker.tasks.scenes.folder_lock import folder_lock

_KILLED = """
import os, signal, sys
from pathlib import Path
from tests.builders import local_place
with local_place(Path(sys.argv[1])).task_folder() as folder:
    (folder / "left").write_text("behind")
    folder.with_name(folder.name + ".txt").write_text("a log")
    os.kill(os.getpid(), signal.SIGKILL)
"""


def test_the_folder_of_a_killed_worker_is_swept_and_of_a_living_one_kept(tmp_path: Path) -> None:
    settings = WorkerSettings(data_dir=tmp_path)
    subprocess.run([sys.executable, "-c", _KILLED, str(tmp_path)], check=False)
    dead, log = sorted(settings.attempts_dir.iterdir())
    living = settings.attempts_dir / "living"
    living.mkdir()
    with folder_lock(living):
        sweep_scratch(settings)
        assert not dead.exists()
        assert not log.exists()
        assert living.exists()


_KILLED_WHILE_IT_UNPACKS = """
import os, signal, sys
from pathlib import Path
from tests.unit.worker.tasks.scenes.test_bundle_folder import with_bundle
from worker.tasks.scenes import bundle_folder
place, digest = with_bundle(Path(sys.argv[1]))
def killed(data, folder):
    (folder / "a.pov").touch()
    os.kill(os.getpid(), signal.SIGKILL)
bundle_folder.unpack = killed
with place.bundle(digest):
    pass
"""


def test_a_bundle_that_a_killed_process_did_not_finish_to_unpack_is_swept(tmp_path: Path) -> None:
    settings = WorkerSettings(data_dir=tmp_path / "data")
    subprocess.run([sys.executable, "-c", _KILLED_WHILE_IT_UNPACKS, str(tmp_path)], check=False)
    (left,) = settings.bundles_dir.iterdir()
    assert (left / "whole" / "a.pov").exists()
    sweep_attempts(settings)
    assert list(settings.bundles_dir.iterdir()) == []


def test_a_bundle_that_is_being_unpacked_is_not_swept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    place, digest = with_bundle(tmp_path)

    def swept_meanwhile(data: bytes, folder: Path) -> None:
        sweep_attempts(place.settings)
        assert folder.is_dir()
        unpack(data, folder)

    monkeypatch.setattr(bundle_folder, "unpack", swept_meanwhile)
    with place.bundle(digest) as folder:
        assert (folder / "a.pov").is_file()


def test_a_new_folder_that_is_not_locked_yet_is_not_swept(tmp_path: Path) -> None:
    settings = WorkerSettings(data_dir=tmp_path)
    new = settings.attempts_dir / "new"
    new.mkdir(parents=True)
    with ThreadPoolExecutor(1) as pool, ExitStack() as attempt:
        with folder_lock(settings.attempts_dir, wait=True):
            swept = pool.submit(sweep_scratch, settings)
            with pytest.raises(TimeoutError):
                swept.result(timeout=1)
            attempt.enter_context(folder_lock(new))
        swept.result(ENOUGH_S)
        assert new.exists()


def test_a_folder_to_which_a_dying_program_still_writes_is_removed_a_little_later(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    settings = WorkerSettings(data_dir=tmp_path)
    (settings.attempts_dir / "dead" / "below").mkdir(parents=True)
    remove_empty, writes = os.rmdir, iter(["a picture", "a log"])

    def written_to_meanwhile(path: str, **options: Any) -> None:
        if path == "below" and (name := next(writes, None)):
            (settings.attempts_dir / "dead" / "below" / name).touch()
        remove_empty(path, **options)

    monkeypatch.setattr(os, "rmdir", written_to_meanwhile)
    sweep_scratch(settings)
    assert list(settings.attempts_dir.iterdir()) == []
    assert "not removed" not in capsys.readouterr().out


def test_one_scratch_folder_that_cannot_be_removed_keeps_no_other_and_is_logged(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    settings = WorkerSettings(data_dir=tmp_path)
    settings.bundles_dir.mkdir(parents=True)
    for name in ("kept", "removed"):
        (settings.bundles_dir / name).mkdir()
        os.utime(settings.bundles_dir / name, (0, 0))
    with _mount_point(settings.bundles_dir / "kept"):
        os.utime(settings.bundles_dir / "kept", (0, 0))
        sweep_scratch(settings)
    assert [path.name for path in settings.bundles_dir.iterdir()] == ["kept"]
    assert "scratch folder not removed" in capsys.readouterr().out


@contextmanager
def _mount_point(folder: Path) -> Iterator[None]:
    """Make a folder that cannot be removed, also by root."""
    need_to_run(["mount", "-t", "tmpfs", "tmpfs", folder], what="cannot mount a file system")
    try:
        yield
    finally:
        subprocess.run(["umount", "--lazy", str(folder)], check=True, timeout=30)
