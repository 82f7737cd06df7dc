"""What some tests need of the machine: missing, it skips them at home and fails in continuous integration."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Sequence
from typing import NoReturn

import pytest

needs_ffprobe = pytest.mark.skipif(
    shutil.which("ffprobe") is None and "CI" not in os.environ, reason="needs ffprobe (it is there in CI)"
)
needs_povray = pytest.mark.skipif(
    shutil.which("povray") is None and "CI" not in os.environ, reason="needs POV-Ray (it is there in CI)"
)


def missing(what: str) -> NoReturn:
    """Skip the test at home, and fail it in continuous integration, where everything must be there."""
    if "CI" in os.environ:
        pytest.fail(what)
    pytest.skip(what)


def need_to_run(command: Sequence[str | os.PathLike[str]], *, what: str) -> None:
    """See that a command works on this machine; `what` says what is missing if it does not."""
    try:
        ran = subprocess.run(command, capture_output=True, text=True, check=False)
    except OSError as error:
        missing(f"{what}: {error}")
    if ran.returncode:
        missing(f"{what}: {ran.stderr.strip()}")
