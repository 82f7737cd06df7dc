"""The sandboxes as a worker that is not root has them, and a picture that a taken-over POV-Ray makes."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

import worker
from worker.sandbox.own_user import is_open_to_all

NOBODY = 65_534
ROOT = Path(worker.__file__).parents[1]

TRIAL = """
from worker.sandbox.detect import trial
from worker.sandbox.sandbox import Sandbox
faults = [trial(Sandbox(mode)) for mode in ("bwrap", "landlock")]
assert faults == [None, None], faults
"""


@pytest.mark.skipif(os.geteuid() != 0, reason="only root becomes another user, and others run every test as one")
def test_both_sandboxes_hold_for_a_worker_that_is_not_root() -> None:
    pythons = [Path(os.path.realpath(sys.executable)), Path("/usr/bin/python3")]
    reachable = [python for python in pythons if python.exists() and is_open_to_all([python])]
    if not reachable or not is_open_to_all([ROOT]):
        pytest.skip("this Python and this source are closed to other users")
    user = ["setpriv", f"--reuid={NOBODY}", f"--regid={NOBODY}", "--clear-groups", "--"]
    environment = {"PYTHONPATH": str(ROOT), "PYTHONDONTWRITEBYTECODE": "1", "PATH": "/usr/bin:/bin"}
    line = [*user, str(reachable[0]), "-c", TRIAL]
    ran = subprocess.run(line, env=environment, cwd="/", capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stderr
