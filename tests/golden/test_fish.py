"""One small frame of the fish scene against the picture that was looked at and blessed.

`LIPPMANN_BLESS=1 pytest tests/golden` writes the picture anew: look at it before you commit it.
"""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from lippmann.job.messages.orders import TaskKind
from lippmann.plan import artifact_names as names
from lippmann.plan.sampling import cut_tiles, frame_size
from tests.builders import local_place, order_of, small_job, stored_job, stored_picture
from tests.pictures import read_png
from worker.images.write import write_png
from worker.tasks.attempts.monitor import NullMonitor
from worker.tasks.frames.assemble import assemble_frame
from worker.tasks.frames.render import render_tile

GOLDEN = Path(__file__).parent / "fish-frame-5.png"

MEAN_CODES = 0.25
"""Other compilers and processors round a few pixels to a neighbouring code; a changed picture is far beyond."""
FAR_CODES = 8
FAR_SHARE = 0.002


def test_a_frame_of_the_fish_is_the_blessed_one(tmp_path: Path) -> None:
    spec = small_job(
        "fish",
        count=(24, 24),
        px_per_lens=6,
        frames="5",
        lens_array={"pitch_mm": 3.75, "focal_length_mm": 12.0},
    )
    place = local_place(tmp_path)
    stored_job(place, spec)
    (tile,) = cut_tiles(frame_size(spec.rig), tile_rows=1, tile_cols=1)
    render_tile(place, order_of(TaskKind.RENDER, frame=5, tile=tile), NullMonitor())
    assemble_frame(place, order_of(TaskKind.ASSEMBLE, frame=5), NullMonitor())
    found = tmp_path / "found.png"
    write_png(found, stored_picture(place, names.orthoscopic_name(5)))
    if os.environ.get("LIPPMANN_BLESS"):
        GOLDEN.write_bytes(found.read_bytes())
        pytest.fail(f"blessed {GOLDEN.name}: look at it, then run the test again without LIPPMANN_BLESS")
    assert_alike(read_png(found), read_png(GOLDEN))


def assert_alike(found: NDArray[np.uint8], golden: NDArray[np.uint8]) -> None:
    assert found.shape == golden.shape
    difference = np.abs(found.astype(int) - golden.astype(int))
    assert difference.mean() <= MEAN_CODES
    assert (difference > FAR_CODES).mean() <= FAR_SHARE
