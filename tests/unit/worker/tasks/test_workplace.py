"""Scratch folders: of living attempts kept, of dead ones removed."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from worker.settings import WorkerSettings
from worker.tasks.workplace import folder_lock, sweep_scratch

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


def test_a_locked_folder_cannot_be_locked_again(tmp_path: Path) -> None:
    with folder_lock(tmp_path), pytest.raises(BlockingIOError), folder_lock(tmp_path):
        pass
