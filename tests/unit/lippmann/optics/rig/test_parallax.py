"""What moves over the lenses from view to view, pixel by pixel: against the same point found in the next view."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.interpolate import griddata
from scipy.optimize import brentq

from lippmann.job.optics.rig import Rig
from lippmann.lightfield.sheet.orthoscopic import orthoscopic
from lippmann.lightfield.views.views import view
from lippmann.optics.rig import array as lattice
from lippmann.optics.rig.bench import Bench, bench, object_rays, pixel_centres_mm
from lippmann.optics.rig.disparity import exact_disparity, small_angle_disparity
from lippmann.optics.rig.parallax import depth_on_display_mm, parallax
from lippmann.plan.sampling import display_size, frame_size
from tests.repository import DOCS

RIGS: dict[str, dict[str, Any]] = {
    "square": {},
    "hexagonal": {"lens_array": {"lattice": "hexagonal"}},
    "hexagonal, odd lens rows": {"lens_array": {"lattice": "hexagonal", "count": [11, 12]}},
    "perspective": {"camera": {"projection": "perspective", "angle_deg": 1.0}},
    "direct pickup": {"imaging_lens": None, "lens_array": {"offset_mm": -60.0}},
}

PITCHES = 1.5e-3
"""The shift is 0.4 pitches; what it differs by from the mean of both views' falls with the square of the step."""
LEAST = 60
"""Lenses whose point the next view shows too."""


def rig_of(changes: dict[str, Any]) -> Rig:
    array = {"count": [12, 12], "offset_mm": 30.0, **changes.get("lens_array", {})}
    return Rig.model_validate({"px_per_lens": 24, **changes, "lens_array": array})


def seen_and_moved(here: Bench, points: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    hits = object_rays(here, points).at_z(-1000.0)
    return hits[..., :2], parallax(here, points, hits[..., 2])


@pytest.mark.parametrize(("du", "dv"), [(1, 0), (0, 1)])
@pytest.mark.parametrize("changes", RIGS.values(), ids=RIGS.keys())
def test_the_same_point_stands_so_many_pitches_further_in_the_next_view(
    changes: dict[str, Any], du: int, dv: int
) -> None:
    rig = rig_of(changes)
    here = bench(rig, reference_mm=1000.0)
    inverted = rig.imaging_lens is not None
    points = orthoscopic(pixel_centres_mm(here), frame_size(rig), inverted=inverted)
    layout = display_size(rig)
    u, v = layout.cell_cols // 2 - 1, layout.cell_rows // 2 - 1
    (first, moves), (second, moves_there) = (
        seen_and_moved(here, view(points, layout, *number)) for number in ((u, v), (u + du, v + dv))
    )
    # The array turned by 180 degrees is another one where its odd number of rows is.
    places = lattice.lens_centres_mm(rig.lens_array)
    places = -places[::-1, ::-1] if inverted else places
    found = np.stack(
        [griddata(second.reshape(-1, 2), places[..., axis].ravel(), first) for axis in (0, 1)],
        axis=-1,
    )
    there = np.isfinite(found).all(axis=-1)
    assert there.sum() > LEAST
    mean = (moves + moves_there)[there] / 2
    expected = np.stack((-mean[:, 0] * du, mean[:, 1] * dv), axis=-1)
    np.testing.assert_allclose((found - places)[there], expected, atol=PITCHES)


@pytest.mark.parametrize("imaging_lens", ["athineos-2006", None])
@pytest.mark.parametrize("object_mm", [1000.0, 1500.0])
def test_over_a_whole_cell_it_comes_to_the_shift_of_the_exact_trace(imaging_lens: str | None, object_mm: float) -> None:
    """Of each pixel of a cell's middle row, under the lens where it sees the axis point, from the first to the last."""
    n, lenses = 32, 41
    array = {"count": [lenses, lenses], "offset_mm": 30.0 if imaging_lens else -60.0}
    here = bench(rig_of({"imaging_lens": imaging_lens, "px_per_lens": n, "lens_array": array}), reference_mm=1000.0)
    row = lenses * n // 2
    points = pixel_centres_mm(here, region=(slice(row, row + 1), slice(None)))
    hits = object_rays(here, points).at_z(-object_mm)
    seen, moves = hits[0, :, 0].reshape(-1, n), parallax(here, points, hits[..., 2])[0, :, 0].reshape(-1, n)
    order = np.argsort(seen, axis=0)
    local = [np.interp(0.0, seen[order[:, p], p], moves[order[:, p], p]) for p in range(n)]
    # From pixel to pixel the mean of both.
    places = np.concatenate(([0.0], np.cumsum(np.convolve(local, [0.5, 0.5], "valid"))))
    assert np.polyfit(range(n), places, 1)[0] == pytest.approx(exact_disparity(here, object_mm), rel=5e-4, abs=1e-3)


def test_on_the_axis_of_fine_lenses_it_is_the_law_of_small_angles() -> None:
    rig = rig_of({"px_per_lens": 32, "lens_array": {"count": [1, 1], "focal_length_mm": 33.0}})
    here = bench(rig, reference_mm=1000.0)
    points = pixel_centres_mm(here)[15:17, 15:17]
    moves = parallax(here, points, np.full((2, 2), -1000.0))
    assert moves == pytest.approx(small_angle_disparity(here, 1000.0), rel=2e-3)
    assert depth_on_display_mm(moves, rig) == pytest.approx(here.s_mm(1000.0) + 33.0, rel=2e-3)


def test_nothing_moves_beside_the_glass_or_where_nothing_is_met() -> None:
    rig = rig_of({"lens_array": {"aperture": "inscribed", "count": [2, 2]}})
    here = bench(rig, reference_mm=1000.0)
    points = pixel_centres_mm(here)
    depths = np.full(points.shape[:2], -1000.0)
    depths[4, 4] = np.nan
    moves = parallax(here, points, depths)
    assert np.isnan(moves[0, 0]).all(), "the dead corner of an inscribed aperture"
    assert np.isnan(moves[4, 4]).all()
    assert np.isfinite(moves[4, 5]).all()


def test_the_page_on_depth_says_how_disparity_differs_over_the_views() -> None:
    """Disparity is s / (n f) in the paraxial approximation; the parallax of the next view is 1 / n larger."""
    page = " ".join((DOCS / "depth.md").read_text("utf-8").split())
    (said,) = re.findall(r"at s = \+([0-9.]+) mm .* moves by ([0-9.]+) pitches .* and by ([0-9.]+) at their edge", page)
    s_mm, middle, edge = map(float, said)
    optical_bench = bench(Rig(), reference_mm=1000.0)
    object_mm = float(brentq(lambda mm: optical_bench.s_mm(mm) - s_mm, 1000.0, 2000.0))
    n, first = optical_bench.rig.px_per_lens, optical_bench.rig.lens_array.count[0] // 2 * optical_bench.rig.px_per_lens
    points = pixel_centres_mm(optical_bench)[first + n // 2 - 1, first : first + n]
    across = parallax(optical_bench, points, np.full(n, -object_mm))[:, 0] - 1 / n
    assert across[n // 2 - 1 : n // 2 + 1].mean() == pytest.approx(middle, abs=0.006)
    assert across[[0, -1]].mean() == pytest.approx(edge, abs=0.006)
