"""A preview that follows a slider: the fish in meshes on a farm, asked for over HTTP while the rig changes."""

from __future__ import annotations

import time
from pathlib import Path
from statistics import median

from tests.farm import farm_up
from tests.waiting import until

ROUNDS = 12
"""The number of previews after the first one, which starts the engine and loads the scene."""


def warm_ms(folder: Path) -> str:
    """Return the median time of a warm preview of 45 x 45 lenses of 8 px, and of its CPU at the worker."""
    walls_s, cpus_s = [], []
    with farm_up(folder, slots=1, env={"LIPPMANN_MITSUBA": "auto"}) as farm:
        until(lambda: farm.client.workers().items)
        for number in range(ROUNDS + 1):
            rig = {"lens_array": {"offset_mm": 30.0 + number}}
            began_s = time.monotonic()
            preview = farm.client.preview({"scene": "fish-mesh", "rig": rig}, stream="slider")
            walls_s.append(time.monotonic() - began_s)
            cpus_s.append(preview.times.cpu_s)
    wall_ms, cpu_ms, cold_ms = (1000 * value for value in (median(walls_s[1:]), median(cpus_s[1:]), walls_s[0]))
    return f"{wall_ms:.0f} ms ({cpu_ms:.0f} ms CPU at the worker; the first one {cold_ms:.0f} ms)"
