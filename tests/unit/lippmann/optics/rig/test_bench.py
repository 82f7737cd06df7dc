"""Where the camera stands."""

from __future__ import annotations

from typing import Any

import pytest

from lippmann.errors import OpticsError
from lippmann.job.spec import parse_spec
from lippmann.optics.rig.bench import Bench, bench


def bench_of(**rig: Any) -> Bench:
    return bench(parse_spec({"scene": "fish", "rig": rig}).rig, reference_mm=1000.0)


@pytest.mark.parametrize("lens_array", [{}, {"count": [1, 1], "pitch_mm": 150, "focal_length_mm": 330}])
def test_an_orthographic_camera_stands_behind_the_lenses_however_thick(lens_array: dict[str, Any]) -> None:
    found = bench_of(lens_array=lens_array)
    assert found.camera_z_mm - found.mla_z_mm >= 2 * found.microlens.thickness_mm


@pytest.mark.parametrize(("angle_deg", "stands"), [(78.0, True), (79.0, False)])
def test_a_perspective_camera_among_the_lenses_is_refused(angle_deg: float, *, stands: bool) -> None:
    rig = {
        "lens_array": {"count": [1, 1], "pitch_mm": 2.26},
        "camera": {"projection": "perspective", "angle_deg": angle_deg},
    }
    if stands:
        assert bench_of(**rig).camera_z_mm > bench_of(**rig).mla_z_mm + bench_of(**rig).microlens.thickness_mm
        return
    with pytest.raises(OpticsError, match=r"rig\.camera\.angle_deg: expected at most 78\.46 degrees.* got 79 degrees"):
        bench_of(**rig)
