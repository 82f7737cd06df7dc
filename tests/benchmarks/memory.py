"""Peak memory of assembling a large frame, in a process of its own."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

_RUN = """
import sys
from pathlib import Path
import numpy as np
from tests.builders import local_place, order_of, small_job, stored_job, tiles_of
from worker.images.write import write_exr
from lippmann.job.messages.orders import TaskKind
from lippmann.plan import artifact_names as names
from worker.tasks.frames.assemble import assemble_frame
from worker.tasks.local import JOB_ID
from worker.tasks.attempts.monitor import NullMonitor

place = local_place(Path(sys.argv[1]))
spec = small_job("fish", count=(100, 100), px_per_lens=24, tiles=[8, 1])
stored_job(place, spec)
noise = np.random.default_rng(1)
for tile in tiles_of(spec):
    with place.task_folder() as folder:
        light = noise.random((tile.rows, tile.cols, 3), dtype=np.float32).astype(np.float16)
        write_exr(folder / "tile.exr", light, attributes={})
        place.store.put_file(names.job_artifact(JOB_ID, names.tile_name(1, tile.index)), folder / "tile.exr")
assemble_frame(place, order_of(TaskKind.ASSEMBLE), NullMonitor())
# The maximum of getrusage begins with that of the process which started this one.
(line,) = (line for line in open("/proc/self/status") if line.startswith("VmHWM"))
print(int(line.split()[1]) / 1024)
"""


def assemble_mb(folder: Path) -> str:
    """Return the peak memory of making 8 tiles of noise into everything that is shown of a frame."""
    ran = subprocess.run([sys.executable, "-c", _RUN, str(folder)], check=True, capture_output=True, text=True)
    return f"{float(ran.stdout):.0f} MB"
