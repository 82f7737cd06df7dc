"""A captured point, real and virtual, comes together at its depth and no other, by both ways of refocusing."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lippmann.job.messages.orders import TaskKind
from lippmann.lightfield.refocus.ciir import ciir_stack
from lippmann.lightfield.refocus.shift_and_sum import focal_stack
from lippmann.optics.rig.bench import bench
from lippmann.optics.rig.disparity import exact_disparity
from lippmann.plan import artifact_names as names
from lippmann.plan.sampling import display_size
from tests.builders import local_place, order_of, small_job, stored_job, stored_picture, tiles_of
from tests.needs import needs_povray
from tests.unit.lippmann.lightfield.sheets import image_of
from worker.tasks.attempts.monitor import NullMonitor
from worker.tasks.frames.assemble import assemble_frame
from worker.tasks.frames.render import render_tile

pytestmark = needs_povray

FOCAL_MM = 3.3
DISTANCE_MM = 1000.0
STEP_MM = FOCAL_MM
"""Of the depths: as deep as the focus is (docs/views.md)."""


@pytest.mark.parametrize("lattice", ["square", "hexagonal"])
@pytest.mark.parametrize("s_mm", [30.0, -30.0])
def test_a_captured_point_comes_together_at_its_depth(tmp_path: Path, lattice: str, s_mm: float) -> None:
    """A ball shown about 2.4 mm wide, through a lens that makes a point of a point: what is at s is shown at s + f."""
    spec = small_job(
        "target-points",
        count=(22, 20),
        px_per_lens=8,
        rig={"imaging_lens": "double-gauss-tronnier"},
        lens_array={"offset_mm": s_mm, "lattice": lattice},
        capture={"method": "ray_camera"},
        parameters={"distance_mm": DISTANCE_MM, "radius_mm": 1.2 * DISTANCE_MM / 50.0},
    )
    place = local_place(tmp_path)
    stored_job(place, spec)
    for tile in tiles_of(spec):
        render_tile(place, order_of(TaskKind.RENDER, tile=tile), NullMonitor())
    assemble_frame(place, order_of(TaskKind.ASSEMBLE), NullMonitor())
    sheet, layout = stored_picture(place, names.orthoscopic_name(1)), display_size(spec.rig)

    optical_bench = bench(spec.rig, reference_mm=DISTANCE_MM)
    step = exact_disparity(optical_bench, DISTANCE_MM)
    assert step is not None
    shown_mm = step * spec.rig.px_per_lens * FOCAL_MM
    assert shown_mm == pytest.approx(s_mm + FOCAL_MM, abs=1.0)
    depths_mm = np.arange(-13, 14) * STEP_MM
    for stack in (
        focal_stack(image_of(sheet, layout, focal_length_mm=FOCAL_MM), depths_mm.tolist()),
        ciir_stack(image_of(sheet, layout, focal_length_mm=FOCAL_MM), depths_mm.tolist(), px_per_lens=2),
    ):
        brightest_mm = depths_mm[int(np.argmax(stack.max(axis=(1, 2, 3))))]
        assert abs(brightest_mm - shown_mm) <= STEP_MM
