"""How quickly a stack of refocused pictures is made, in a process of its own, on one thread as in a worker's slot."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

_RUN = """
import time
import numpy as np
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.image import IntegralImage
from lippmann.lightfield.refocus.shift_and_sum import focal_stack

layout, depths_mm = CellLayout(720, 1280, 8), np.linspace(-30.0, 30.0, 16).tolist()
pixels = np.random.default_rng(1).random((layout.rows, layout.cols, 3), dtype=np.float32).astype(np.float16)
image = IntegralImage(pixels=pixels, layout=layout, pitch_mm=1.0, focal_length_mm=3.3)
spent_s = []
for _ in range(3):
    before = time.process_time()
    focal_stack(image, depths_mm)
    spent_s.append(time.process_time() - before)
print(len(depths_mm) / min(spent_s))
"""


def planes_per_s(_: Path) -> str:
    """Return the planes in a CPU second: 16 from -30 to +30 mm, of 720 x 1280 lenses of 8 x 8 px and 3.3 mm."""
    ran = subprocess.run(
        [sys.executable, "-c", _RUN],
        check=True,
        capture_output=True,
        text=True,
        env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},
    )
    return f"{float(ran.stdout):.1f}"
