"""The lock of a folder, between processes and over forks."""

from __future__ import annotations

import os
import signal
from pathlib import Path

import pytest

from worker.tasks.scenes.folder_lock import folder_lock


def test_a_locked_folder_cannot_be_locked_again(tmp_path: Path) -> None:
    with folder_lock(tmp_path), pytest.raises(BlockingIOError), folder_lock(tmp_path):
        pass


def test_a_lock_is_free_once_it_was_released_although_a_process_was_forked_meanwhile(tmp_path: Path) -> None:
    with folder_lock(tmp_path):
        child = os.fork()
        if child == 0:
            signal.pause()
    try:
        with folder_lock(tmp_path):
            pass
    finally:
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
