"""The installed version of POV-Ray."""

from __future__ import annotations

import re
import shutil
import subprocess

from lippmann.errors import PovrayMissing

_VERSION = re.compile(r"POV-Ray (\d+\.\d+\S*)")
_ANSWER_S = 20


def check_povray(command: str) -> None:
    """Check that POV-Ray is installed.

    Raises
    ------
    PovrayMissing
        If it is not installed.
    """
    if shutil.which(command) is None:
        raise PovrayMissing(
            f"expected POV-Ray as {command!r} on PATH, got none; install it (Debian: apt-get install povray "
            "povray-includes) or name it in LIPPMANN_POVRAY"
        )


def povray_version(program: str) -> str:
    """Return the version that POV-Ray reports.

    Raises
    ------
    PovrayMissing
        If there is no such program, or it is not POV-Ray.
    """
    try:
        said = subprocess.run([program, "--version"], capture_output=True, text=True, timeout=_ANSWER_S, check=False)
    except (OSError, subprocess.TimeoutExpired) as error:
        raise PovrayMissing(f"expected POV-Ray 3.7 as {program!r}, got {error}") from error
    found = _VERSION.search(said.stdout + said.stderr)
    if found is None:
        raise PovrayMissing(f"expected POV-Ray 3.7 as {program!r}, got {(said.stdout + said.stderr)[:200]!r}")
    return found[1]
