"""The trial of a folder in which attempts work."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path

import pytest

from lippmann.errors import DiskUnavailable
from worker.whole_file import check_folder

_KILLED = """
import resource, signal, sys
from pathlib import Path
from worker.whole_file import check_folder
signal.signal(signal.SIGXFSZ, signal.SIG_DFL)
resource.setrlimit(resource.RLIMIT_FSIZE, (0, 0))
check_folder(Path(sys.argv[1]))
"""
"""The kernel kills the process when it writes to the file of the trial."""


def test_a_process_that_is_killed_while_it_tries_a_folder_leaves_nothing_there(tmp_path: Path) -> None:
    ran = subprocess.run([sys.executable, "-c", _KILLED, str(tmp_path / "scratch")], check=False)
    assert ran.returncode == -signal.SIGXFSZ
    assert list((tmp_path / "scratch").iterdir()) == []


def test_a_folder_that_can_be_written_is_left_empty_and_another_one_is_unavailable(tmp_path: Path) -> None:
    check_folder(tmp_path)
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(DiskUnavailable, match="cannot write in /proc: "):
        check_folder(Path("/proc"))
