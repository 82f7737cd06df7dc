"""Make `old_farm_REVISION.tar.xz`: the data folder of a farm of an older version, killed in the middle of a job.

The versions are commit 43cd948 (revision 0002) and commit 5191796 (revision 0009), the last one before stores in
buckets.
It runs with that version, and only the standard library:

    git worktree add /tmp/old 5191796
    python3 -m venv /tmp/old/.venv && /tmp/old/.venv/bin/pip install /tmp/old
    cd tests/integration/lippmann && PATH=/tmp/old/.venv/bin:$PATH python3 old_farm.py old_farm_0009.tar.xz

The folder holds the database, without posters and without the scenes that the job does not use, and the artifacts of
the job. The broker's data is left out, as if it had been wiped.
"""

from __future__ import annotations

import json
import os
import signal
import sqlite3
import subprocess
import sys
import tarfile
import tempfile
import time
from contextlib import closing
from pathlib import Path

SCENE = "target-white"
JOB = {"scene": SCENE, "frames": "1-7", "rig": {"lens_array": {"count": [4, 4]}, "px_per_lens": 4}}
MID_JOB = """
SELECT sum(kind = 'assemble' AND status = 'done') >= 2 AND sum(status = 'running') >= 1
    AND sum(kind = 'render' AND status IN ('ready', 'dispatched')) >= 2
FROM tasks
"""


def main(target: Path) -> None:
    """Run a farm until it is in the middle of a job, kill it, and pack its folder."""
    with tempfile.TemporaryDirectory() as folder:
        data = Path(folder) / "data"
        up = ["lippmann", "up", "--json", "--port", "0", "--slots", "2", "--data-dir", str(data)]
        with subprocess.Popen(up, stdout=subprocess.PIPE, start_new_session=True) as farm:
            assert farm.stdout is not None
            farm.stdout.readline()
            submit = ["lippmann", "submit", "-", "--data-dir", str(data)]
            subprocess.run(submit, input=json.dumps(JOB), text=True, check=True)
            with closing(sqlite3.connect(data / "lippmann.db")) as connection:
                while not connection.execute(MID_JOB).fetchone()[0]:
                    time.sleep(0.01)
            os.killpg(farm.pid, signal.SIGKILL)
        time.sleep(1.0)  # the children end with their parent
        _pack(data, target)


def _pack(data: Path, target: Path) -> None:
    with closing(sqlite3.connect(data / "lippmann.db")) as connection:
        print(connection.execute("SELECT kind, status, count(*) FROM tasks GROUP BY 1, 2").fetchall())
        connection.execute("UPDATE scenes SET poster = NULL")
        connection.execute("DELETE FROM scenes WHERE name <> ?", (SCENE,))
        (bundle,) = connection.execute("SELECT digest FROM scenes").fetchone()
        connection.commit()
        connection.execute("PRAGMA journal_mode = DELETE")
        connection.execute("VACUUM")
    artifacts = data / "artifacts"
    paths = [data / "lippmann.db", *artifacts.rglob("*")]
    with tarfile.open(target, "w:xz") as archive:
        for path in sorted(paths):
            is_other_scene = path.parent.name == "scenes" and path.stem != bundle
            if path.is_file() and not is_other_scene and ".partial" not in path.parts:
                archive.add(path, path.relative_to(data), filter=_anonymous)


def _anonymous(info: tarfile.TarInfo) -> tarfile.TarInfo:
    info.uid = info.gid = 0
    info.uname = info.gname = ""
    return info


if __name__ == "__main__":
    main(Path(sys.argv[1]))
