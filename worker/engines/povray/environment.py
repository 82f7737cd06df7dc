"""The environment of POV-Ray: its own INI file, home and temporary folder, and no variables of the worker.

POV-Ray reads HOME, POVINI, POVINC and POV_TEMP_DIR, and loads a povray.ini from the working directory unless POVINI
names another one.
"""

from __future__ import annotations

import os
from pathlib import Path

from worker.sandbox.sandbox import PATH

_OWN = ".povray"
_INI = "; every option is on the command line; an empty file would be an error\n"
_CONF = "[File I/O Security]\nnone\n\n[Shellout Security]\nforbidden\n"
"""The file security of POV-Ray does nothing in 3.7; the sandbox restricts it."""


def prepare(task_dir: Path, work_dir: Path) -> dict[str, str]:
    """Write POV-Ray's files into the folder of the task and return its whole environment.

    POV-Ray works in `work_dir`, the only folder that it can write; its configuration is outside of it.
    """
    own = task_dir / _OWN
    conf_dir = own / "home" / ".povray" / "3.7"
    conf_dir.mkdir(parents=True, exist_ok=True)
    (conf_dir / "povray.conf").write_text(_CONF)
    (own / "povray.ini").write_text(_INI)
    return environment(task_dir, work_dir)


def environment(task_dir: Path, work_dir: Path) -> dict[str, str]:
    """Return all environment variables of POV-Ray."""
    own = task_dir / _OWN
    return {
        "PATH": PATH,
        "LANG": "C.UTF-8",
        "HOME": ascii_path(own / "home", start=work_dir),
        "POVINI": ascii_path(own / "povray.ini", start=work_dir),
        "POV_TEMP_DIR": ascii_path(work_dir, start=work_dir),
    }


def ascii_path(path: Path, *, start: Path) -> str:
    """Return a path that POV-Ray understands when it runs in the folder `start`.

    POV-Ray 3.7 does not open absolute paths with letters outside ASCII, so such a path is given from `start`.
    """
    return str(path) if str(path).isascii() else os.path.relpath(path, start)
