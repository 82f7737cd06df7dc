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


_SPARSE = """
import time
import numpy as np
from scipy.sparse import csr_matrix
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.image import IntegralImage
from lippmann.lightfield.refocus import shift_and_sum

def by_scipy(light, down, across):
    def matrix(taps, taken):
        return csr_matrix((taps.weight.astype(np.float32), (taps.made, taps.taken)), shape=(taps.pixels, taken))
    planes = [np.ascontiguousarray(light[..., channel], dtype=np.float32) for channel in range(light.shape[2])]
    return np.stack([
        np.stack([(matrix(one, light.shape[1]) @ (matrix(other, light.shape[0]) @ plane).T).T for plane in planes], -1)
        for other, one in zip(down, across)
    ])

layout, depths_mm = CellLayout(360, 640, 8), np.linspace(-30.0, 30.0, 16).tolist()
pixels = np.random.default_rng(1).random((layout.rows, layout.cols, 3), dtype=np.float32).astype(np.float16)
image = IntegralImage(pixels=pixels, layout=layout, pitch_mm=1.0, focal_length_mm=3.3)
spent_s, found = {}, {}
for way in (shift_and_sum.weighted_sums, by_scipy):
    shift_and_sum.weighted_sums = way
    for _ in range(3):
        before = time.process_time()
        found[way] = shift_and_sum.focal_stack(image, depths_mm)
        spent_s.setdefault(way, []).append(time.process_time() - before)
dense, sparse = spent_s
assert np.abs(found[dense] - found[sparse]).max() < 1e-5
print(min(spent_s[dense]) / min(spent_s[sparse]))
"""


def sparse_ratio(_: Path) -> str:
    """Return the CPU time of a focal stack by dense matrix products over that by scipy's sparse matrices."""
    return f"{_on_one_thread(_SPARSE):.2f}"


def planes_per_s(_: Path) -> str:
    """Return the planes in a CPU second: 16 from -30 to +30 mm, of 720 x 1280 lenses of 8 x 8 px and 3.3 mm."""
    return f"{_on_one_thread(_RUN):.1f}"


def _on_one_thread(code: str) -> float:
    """Return the number that Python code prints in a process of its own, on one thread as in a worker's slot."""
    ran = subprocess.run(
        [sys.executable, "-c", code],
        check=True,
        capture_output=True,
        text=True,
        env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},
    )
    return float(ran.stdout)
