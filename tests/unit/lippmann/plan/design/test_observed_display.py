"""The display that an observer looks at, from a rig."""

from __future__ import annotations

import tomllib
from typing import Any

import pytest

from lippmann.errors import LayoutError
from lippmann.job.optics.rig import Rig
from lippmann.job.optics.viewing import GapUse
from lippmann.job.resolved import ResolvedJob
from lippmann.job.scenes.scene import SceneManifest
from lippmann.job.spec import Display, parse_spec
from lippmann.optics.rig.display import central_depth_plane_mm
from lippmann.plan.design.designer import design
from lippmann.plan.design.observed_display import observed_display, reduced_mm, used_gap_mm
from lippmann.plan.sampling import display_size
from povtemplates.catalogue import scene_folders


def rig_of(**array: Any) -> Rig:
    return Rig.model_validate({"lens_array": {"count": [10, 12], "substrate_mm": 3.3, **array}, "device": {"dpi": 600}})


def test_lenses_and_pixels_are_the_rigs() -> None:
    rig = rig_of(lattice="hexagonal", aperture="inscribed")
    display = observed_display(rig)
    assert display.layout == display_size(rig)
    assert (display.pitch_mm, display.focal_mm, display.gap_mm, display.aperture) == (1.0, 3.3, 3.3, "inscribed")
    assert display.pixel_mm == pytest.approx((3**0.5 / 2 / 21, 1 / 24))
    assert observed_display(rig, on_device=True).pixel_mm == (25.4 / 600, 25.4 / 600)


@pytest.mark.parametrize(("physical_mm", "plane_mm"), [(4.8, 29.556), (3.3, -6.735)])
def test_a_gap_as_built_is_reduced_by_its_substrate(physical_mm: float, plane_mm: float) -> None:
    gap_mm = reduced_mm(rig_of().lens_array, physical_mm)
    assert central_depth_plane_mm(focal_length_mm=3.3, gap_mm=gap_mm) == pytest.approx(plane_mm, abs=1e-3)
    assert observed_display(rig_of(), gap_mm=gap_mm).gap_mm == gap_mm


@pytest.mark.parametrize("use", ["real", "virtual", "collimated"])
@pytest.mark.parametrize("shown", [{}, {"gap_real_mm": 4.8, "gap_virtual_mm": 3.4}], ids=["chosen", "said"])
def test_gaps_are_those_of_the_design(use: GapUse, shown: dict[str, float]) -> None:
    fish = SceneManifest.model_validate(tomllib.loads((scene_folders()["fish"] / "scene.toml").read_text()))
    job = {"scene": "fish", "rig": {"lens_array": {"substrate_mm": 3.3}}, "display": shown}
    sheet = ResolvedJob.of("design", parse_spec(job), fish, bundle="")
    found = used_gap_mm(sheet.spec.rig, sheet.spec.display, use, stage=sheet.stage)
    assert found == getattr(design(sheet), f"gap_{use}_mm")


def test_without_a_scene_only_gaps_that_are_said_are_known() -> None:
    rig = rig_of()
    assert used_gap_mm(rig, Display(), "collimated", stage=None) == 3.3
    said = Display(gap_real_mm=4.8)
    assert used_gap_mm(rig, said, "real", stage=None) == reduced_mm(rig.lens_array, 4.8)
    with pytest.raises(LayoutError, match=r"expected display\.gap_virtual_mm, as no scene says"):
        used_gap_mm(rig, said, "virtual", stage=None)


def test_what_cannot_be_built_is_refused() -> None:
    with pytest.raises(LayoutError, match=r"expected a reduced gap of at least 2\.215 mm, .* got 2\.2 mm"):
        observed_display(rig_of(), gap_mm=2.2)
    with pytest.raises(LayoutError, match="expected a positive gap in mm, got 0"):
        observed_display(rig_of(), gap_mm=0.0)
    with pytest.raises(LayoutError, match=r"at least the substrate's 3\.3 mm, got 3 mm"):
        reduced_mm(rig_of().lens_array, 3.0)
    with pytest.raises(LayoutError, match=r"expected a rig with a device, .* got rig\.device null"):
        observed_display(Rig(), on_device=True)
