"""How long a picture takes that the service makes when it is asked, over HTTP."""

from __future__ import annotations

import time
from pathlib import Path

from lippmann.client.client import FramePicture
from tests.farm import Farm, ended, farm_up

ROUNDS = 8
ASKED: tuple[tuple[FramePicture, str], ...] = (("view", "u"), ("perspective", "x"), ("refocus", "depth_mm"))
"""What is asked for, and the number that changes from one to the next."""


def slowest_ms(folder: Path) -> str:
    """Return the time of the slowest kind of picture of a 720 x 720 px sheet that is in memory; its best of some."""
    with farm_up(folder / "data") as farm:
        job = ended(farm.client, farm.client.submit({"scene": "fish", "outputs": []}).id, within_s=600)
        took_ms = {what: _best_ms(farm, job.id, what, number, folder / "picture.png") for what, number in ASKED}
    slowest = max(took_ms, key=lambda what: took_ms[what])
    return f"{took_ms[slowest]:.1f} ms ({slowest})"


def _best_ms(farm: Farm, job_id: str, what: FramePicture, number: str, path: Path) -> float:
    took_s = []
    for value in range(ROUNDS):
        started_s = time.monotonic()
        farm.client.download_picture(job_id, 1, what, path, **{number: value})
        took_s.append(time.monotonic() - started_s)
    return 1000 * min(took_s)
