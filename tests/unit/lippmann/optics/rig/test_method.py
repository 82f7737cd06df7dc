"""How small a rig may be modelled in glass: POV-Ray's tolerances are lengths in the scene's units."""

from __future__ import annotations

from typing import Any

import pytest

from lippmann.errors import OpticsError
from lippmann.job.scenes.stage import Stage
from lippmann.job.spec import parse_spec
from lippmann.optics.rig.method import capture_method


def surface(radius_mm: float | None, thickness_mm: float, index: float, semi_aperture_mm: float) -> dict[str, Any]:
    return {
        "radius_mm": radius_mm,
        "thickness_mm": thickness_mm,
        "index": index,
        "semi_aperture_mm": semi_aperture_mm,
    }


PLANO_CONVEX = {"surfaces": [surface(None, 20, 1.6, 40), surface(-120, 0, 1, 40)]}
NARROW_FACE = {"surfaces": [surface(None, 20, 1.6, 12), surface(-120, 0, 1, 40)]}
CEMENT = {
    "surfaces": [
        surface(150, 30, 1.6, 40),
        surface(-100, 0.02, 1.55, 40),
        surface(-100, 10, 1.7, 40),
        surface(-400, 0, 1, 40),
    ]
}
WIDE_ARRAY = {"pitch_mm": 5.0, "focal_length_mm": 16.5}


@pytest.mark.parametrize(
    ("rig", "most_mm_per_unit"),
    [
        ({"imaging_lens": None, "lens_array": {"offset_mm": -10}}, 200.0),
        ({}, 10.0),
        ({"imaging_lens": PLANO_CONVEX}, 200.0),
        ({"imaging_lens": PLANO_CONVEX, "f_number": 8}, 10.0),
        ({"imaging_lens": PLANO_CONVEX | {"stop_z_mm": -50}, "f_number": 8}, 200.0),
        ({"imaging_lens": NARROW_FACE}, 10.0),
        ({"imaging_lens": CEMENT}, 74.0),
        ({"imaging_lens": PLANO_CONVEX, "lens_array": WIDE_ARRAY}, 1000.0),
        ({"imaging_lens": None, "lens_array": {"offset_mm": -10, "focal_length_mm": 1000}}, 0.85),
    ],
    ids=["array", "contact", "single lens", "stop on glass", "stop afar", "baffle on glass", "cement", "wide", "flat"],
)
def test_glass_is_modelled_up_to_where_its_narrowest_gap_is_seen(rig: dict[str, Any], most_mm_per_unit: float) -> None:
    spec = parse_spec({"scene": "fish", "rig": rig, "capture": {"method": "glass"}})
    stage = Stage(location=(0, 0, -1000), look_at=(0, 0, 0), reference_mm=1000.0, near_mm=1000.0, far_mm=2500.0)
    assert capture_method(spec, stage.model_copy(update={"mm_per_unit": 0.99 * most_mm_per_unit})) == "glass"
    with pytest.raises(OpticsError, match=r"capture\.method: expected ray_camera, because stage\.mm_per_unit is"):
        capture_method(spec, stage.model_copy(update={"mm_per_unit": 1.01 * most_mm_per_unit}))
