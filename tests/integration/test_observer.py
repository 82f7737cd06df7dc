"""Two eyes before a display that shows a real capture of a point, in front of it and behind it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lippmann.job.messages.orders import TaskKind
from lippmann.job.optics.viewing import EYES_APART_MM
from lippmann.lightfield.observer.observe import whole_window
from lippmann.lightfield.observer.viewing_conditions import ViewingConditions, observed_picture
from lippmann.lightfield.views.perspective import Eye
from lippmann.optics.rig.array import lens_centres_mm
from lippmann.optics.rig.bench import Bench, bench, object_rays
from lippmann.plan import artifact_names as names
from lippmann.plan.design.observed_display import observed_display
from tests.builders import local_place, order_of, small_job, stored_job, stored_picture, tiles_of
from tests.needs import needs_povray
from worker.tasks.attempts.monitor import NullMonitor
from worker.tasks.frames.assemble import assemble_frame
from worker.tasks.frames.render import render_tile

pytestmark = needs_povray

DISTANCE_MM = 500.0
PLACES = 4


@pytest.mark.parametrize(
    ("distance_mm", "magnification", "offset_mm", "s_mm"),
    [(1000.0, 0.284, 30.0, 30.0), (2500.0, 0.118, 20.0, -30.1)],
)
def test_two_eyes_see_a_captured_point_where_the_exact_trace_puts_it(
    tmp_path: Path, distance_mm: float, magnification: float, offset_mm: float, s_mm: float
) -> None:
    """A ball shown 6 mm wide; averaged over a few places of the head, so that no single pixels decide."""
    spec = small_job(
        "target-points",
        count=(13, 28),
        px_per_lens=24,
        lens_array={"offset_mm": offset_mm},
        capture={"method": "ray_camera"},
        parameters={"distance_mm": distance_mm, "radius_mm": 3.0 / magnification},
    )
    place = local_place(tmp_path)
    stored_job(place, spec)
    for tile in tiles_of(spec):
        render_tile(place, order_of(TaskKind.RENDER, tile=tile), NullMonitor())
    assemble_frame(place, order_of(TaskKind.ASSEMBLE), NullMonitor())
    sheet = stored_picture(place, names.orthoscopic_name(1))

    display, optical_bench = observed_display(spec.rig), bench(spec.rig, reference_mm=1000.0)
    window = whole_window(display, size_px=224)
    a_pixel_mm = display.pixel_mm[1] / display.gap_mm * DISTANCE_MM  # how far an eye goes from pixel to pixel
    apart, expected = [], []
    for x_mm in (np.arange(PLACES) + 0.5) / PLACES * a_pixel_mm:
        conditions = ViewingConditions(stereo="side_by_side")
        seen = observed_picture(sheet, display, Eye(x_mm, 0.0, DISTANCE_MM), conditions, window=window)
        left, right = np.split(seen.sum(axis=(0, 2), dtype=float), 2)
        apart.append(window.across_mm @ left / left.sum() - window.across_mm @ right / right.sum())
        eyes_mm = [eye.x_mm for eye in conditions.eyes(Eye(x_mm, 0.0, DISTANCE_MM))]
        expected.append(-np.diff([traced_x_mm(optical_bench, distance_mm, x_mm) for x_mm in eyes_mm])[0])
    assert np.mean(apart) == pytest.approx(np.mean(expected), rel=0.05)
    # What the capture saw at s is shown a focal length nearer; spherical aberration takes up to 6.4 mm from that.
    shown_mm = DISTANCE_MM * np.mean(expected) / (EYES_APART_MM + np.mean(expected))
    assert optical_bench.s_mm(distance_mm) == pytest.approx(s_mm, abs=0.1)
    assert s_mm + 3.3 - 6.4 < shown_mm < s_mm + 3.3 + 0.1


def traced_x_mm(optical_bench: Bench, object_mm: float, eye_mm: float) -> float:
    """Return where on the display an eye sees the axis point of an object plane, mm to the right, by exact rays.

    Under each lens of the capture's middle row, where does a pixel lie that sees the point? Turned by 180 degrees, the
    lens at c stands at -c on the display, with its cell as captured; and there the eye at x looks at -g (x + c) / L.
    """
    array = optical_bench.rig.lens_array
    centre_mm = lens_centres_mm(array)[array.count[0] // 2, :, 0]
    offset_mm = np.linspace(-0.49, 0.49, 99)
    at_mm = np.stack(np.broadcast_arrays(centre_mm[:, np.newaxis] + offset_mm, 0.0), axis=-1)
    x_mm = object_rays(optical_bench, at_mm).at_z(-object_mm)[..., 0]
    rising = np.sign(x_mm[:, -1] - x_mm[:, 0])
    sees = np.array(
        [np.interp(0, sign * line, offset_mm, np.nan, np.nan) for sign, line in zip(rising, x_mm, strict=True)]
    )
    misses = sees + array.focal_length_mm * (eye_mm + centre_mm) / DISTANCE_MM
    known = ~np.isnan(misses)
    order = np.argsort(misses[known])
    return -float(np.interp(0, misses[known][order], centre_mm[known][order]))
