"""A test run that is killed leaves no process behind."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from lippmann.farm.supervisor.descendants import kill
from tests.chaos import stuck
from tests.farm import JOB_S
from tests.integration.lippmann.conftest import alive, born, command
from tests.needs import needs_povray
from tests.repository import ROOT
from tests.waiting import until

STARTED = {"lippmann", "valkey-server", "postgres", "chromium", "povray"}
"""The names of some programs that a test run starts, itself or through others."""


@needs_povray
def test_a_killed_test_run_leaves_no_process_behind(tmp_path: Path) -> None:
    ready = tmp_path / "ready"
    arguments = [sys.executable, "-m", "pytest", "-q", "--basetemp", str(tmp_path / "inner"), stuck.__file__]
    with subprocess.Popen(arguments, cwd=ROOT, env=os.environ | {stuck.STUCK_FILE: str(ready)}) as run:
        until(lambda: ready.exists() or run.poll() is not None, within_s=JOB_S)
        assert run.poll() is None
        names = stuck.names_below(run.pid)
        processes = {found for pid in names if (found := born(pid))}
        # POV-Ray has an option -D as well.
        server = next(command(pid) for pid, name in names.items() if name == "postgres" and " -D " in command(pid))
        data = Path(server.split(" -D ")[1].split()[0])
        assert data.is_relative_to(tempfile.gettempdir()), "its folder is removed below"
        run.kill()
    try:
        assert set(names.values()) >= STARTED
        until(lambda: not alive(processes))
    finally:
        kill({pid for pid, _ in alive(processes)})
        shutil.rmtree(data.parent)
