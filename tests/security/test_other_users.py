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

IN_A_CONTAINER = """
import ctypes, errno, platform
from worker.sandbox import landlock, seccomp
from worker.sandbox.detect import detect
landlock._prctl(landlock._PR_SET_NO_NEW_PRIVS, 1)
column = seccomp._COLUMN[platform.machine()]
refuse, allow = seccomp._refuse(errno.EPERM), seccomp._step(seccomp._RETURN, seccomp._ALLOW)
steps = [seccomp._step(seccomp._LOAD, 0)]
for name in ("unshare", "mount", "umount2", "pivot_root", "setns"):
    steps += seccomp._when_called(seccomp._DENIED[name][column], [refuse])
steps += seccomp._when_called(seccomp._JUDGED["clone3"][column], [seccomp._refuse(errno.ENOSYS)])
rule = [seccomp._argument(0), seccomp._step(seccomp._ANY_BIT, seccomp._CLONE_NAMESPACES, 0, 1), refuse, allow]
steps += seccomp._when_called(seccomp._JUDGED["clone"][column], rule)
landlock.filter_calls(b"".join([*steps, allow]))
assert detect("auto").mode == "landlock", detect("auto")
"""
"""What Docker's own filter refuses a container without rights."""

TRIAL = """
from worker.sandbox.detect import trial
from worker.sandbox.sandbox import Sandbox
faults = [trial(Sandbox(mode)) for mode in ("bwrap", "landlock")]
assert faults == [None, None], faults
"""


@pytest.mark.promise(
    "Containers", "A worker that is not root has a sandbox that holds, also within the filter of a container."
)
@pytest.mark.skipif(os.geteuid() != 0, reason="only root becomes another user, and others run every test as one")
@pytest.mark.parametrize("program", [TRIAL, IN_A_CONTAINER], ids=["both hold", "Landlock holds in a container"])
def test_the_sandboxes_of_a_worker_that_is_not_root(program: str) -> None:
    pythons = [Path(os.path.realpath(sys.executable)), Path("/usr/bin/python3")]
    reachable = [python for python in pythons if python.exists() and is_open_to_all([python])]
    if not reachable or not is_open_to_all([ROOT]):
        pytest.skip("this Python and this source are closed to other users")
    user = ["setpriv", f"--reuid={NOBODY}", f"--regid={NOBODY}", "--clear-groups", "--"]
    environment = {"PYTHONPATH": str(ROOT), "PYTHONDONTWRITEBYTECODE": "1", "PATH": "/usr/bin:/bin"}
    line = [*user, str(reachable[0]), "-c", program]
    ran = subprocess.run(line, env=environment, cwd="/", capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stderr
