"""What a job's maker is told about his optics before anything is rendered."""

from __future__ import annotations

import pytest

from worker.errors import OpticsError, SpecError
from worker.job.scene import Stage
from worker.job.spec import JobSpec, parse_spec
from worker.optics.check import check_rig

STAGE = Stage(location=(0, 0, -1000), look_at=(0, 0, 0), reference_mm=1000.0, near_mm=1000.0, far_mm=2500.0)


def job(**lens_array: object) -> JobSpec:
    return parse_spec({"scene": "fish", "rig": {"lens_array": lens_array}})


@pytest.mark.parametrize(
    ("offset_mm", "words"),
    [
        (60.0, "outside the image space, on the lens's side: all is shown real"),
        (40.0, "near parts are shown real, far ones virtual"),
        (10.0, "near parts are shown real, far ones virtual"),
        (-10.0, "outside the image space, on the camera's side: all is shown virtual"),
    ],
)
def test_the_papers_four_positions_are_told_apart(offset_mm: float, words: str) -> None:
    assert words in check_rig(job(offset_mm=offset_mm), STAGE)[0]


def test_an_array_inside_the_imaging_lens_is_refused_by_name() -> None:
    with pytest.raises(OpticsError, match=r"rig\.lens_array\.offset_mm: expected below 184\.3 mm.* got 200 mm"):
        check_rig(job(offset_mm=200.0), STAGE)


def test_an_unknown_imaging_lens_is_refused_with_the_known_ones() -> None:
    spec = parse_spec({"scene": "fish", "rig": {"imaging_lens": "petzval"}})
    with pytest.raises(SpecError, match=r"rig\.imaging_lens: expected one of athineos-2006, got 'petzval'"):
        check_rig(spec, STAGE)


def test_a_slow_imaging_lens_is_said() -> None:
    notes = check_rig(job(focal_length_mm=1.5, pitch_mm=1.0), STAGE)
    assert any("slower than the array" in note for note in notes)
    assert not any("slower" in note for note in check_rig(job(), STAGE))
