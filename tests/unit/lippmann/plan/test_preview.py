"""The job of a preview: the same optics and area with fewer lenses and pixels, and notes on every difference."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lippmann.errors import SpecError
from lippmann.job.resolved import ResolvedJob
from lippmann.job.scenes.scene import SceneManifest
from lippmann.optics.rig.array import extent_mm
from lippmann.plan.preview import BANDS, PreviewJob, PreviewSize, preview_job, rig_numbers
from tests.builders import small_job

SCENE = SceneManifest.model_validate(
    {"title": "s", "stage": {"location": (0, 0, -1000), "look_at": (0, 0, 0), "near_mm": 1000.0, "far_mm": 2000.0}}
)


def previewed(size: PreviewSize, frame: int = 1, **more: Any) -> PreviewJob:
    sheet = ResolvedJob.of("j", small_job("fish", **more), SCENE, bundle="b", frames=9)
    return preview_job(sheet, frame=frame, size=size, owner="ann")


@given(
    st.tuples(st.integers(1, 300), st.integers(1, 300)), st.integers(1, 90), st.sampled_from(["square", "hexagonal"])
)
def test_a_smaller_array_has_the_same_angles_and_area(count: tuple[int, int], lenses: int, lattice: str) -> None:
    before = small_job("fish", count=count, lens_array={"count": count, "lattice": lattice}).rig.lens_array
    after = previewed(PreviewSize(lenses), count=count, lens_array={"count": count, "lattice": lattice}).job
    array = after.spec.rig.lens_array
    assert max(array.count) <= lenses
    assert array.focal_length_mm / array.pitch_mm == pytest.approx(before.focal_length_mm / before.pitch_mm)
    # The last lens of the shorter side is rounded, and hexagonal rows are shifted by half a lens.
    tolerance_mm = 1.25 * array.pitch_mm if max(before.count) > lenses else 1e-9
    for mine_mm, whole_mm in zip(extent_mm(array), extent_mm(before), strict=True):
        assert mine_mm == pytest.approx(whole_mm, abs=tolerance_mm)


def test_the_longer_side_of_a_square_array_stays_as_it_is_exactly() -> None:
    array = previewed(PreviewSize(45), count=(60, 91)).job.spec.rig.lens_array
    assert array.count == (30, 45)
    assert extent_mm(array)[0] == pytest.approx(91.0)


def test_a_small_job_is_left_as_it_is() -> None:
    found = previewed(PreviewSize(), count=(45, 40), px_per_lens=8)
    assert found.notes == ()
    assert found.job.spec.rig == small_job("fish", count=(45, 40), px_per_lens=8).rig


def test_hexagons_keep_an_even_number_of_pixels() -> None:
    array = {"lattice": "hexagonal"}
    assert previewed(PreviewSize(45, 7), px_per_lens=12, lens_array=array).job.spec.rig.px_per_lens == 6
    assert previewed(PreviewSize(45, 7), px_per_lens=12).job.spec.rig.px_per_lens == 7


def test_every_difference_is_noted() -> None:
    found = previewed(
        PreviewSize(45, 8),
        count=(90, 90),
        px_per_lens=24,
        rig={"dispersion": True, "device": {"dpi": 600}},
        capture={"supersample": 3, "depth": True},
        render={"antialias": {"method": 2}},
    )
    assert found.notes == (
        "45 x 45 lenses of 2 mm stand for 90 x 90 of 1 mm, over the same area and with the same angles.",
        "A lens has 8 px in place of 24.",
        "The picture is not resampled for the device.",
        "capture.supersample is 1 in place of 3.",
        "render.antialias is off.",
        "capture.bands is 3 in place of 7.",
    )
    spec = found.job.spec
    assert (spec.capture.supersample, spec.capture.depth, spec.capture.bands) == (1, False, BANDS)
    assert spec.outputs == ()
    assert spec.rig.device is None


def test_the_rig_is_that_of_the_frame() -> None:
    moving = {"rig.lens_array.offset_mm": {"keyframes": [[1, 40.0], [5, 60.0]]}}
    found = previewed(PreviewSize(), frame=3, frames="1-5", animation=moving)
    assert found.job.spec.rig.lens_array.offset_mm == 50.0


def test_what_a_worker_keeps_is_kept_by_owner() -> None:
    job = previewed(PreviewSize()).job
    assert (job.job_id, job.cache_scope) == ("preview", "ann")


def test_the_numbers_of_the_rig_are_those_of_the_smaller_one() -> None:
    numbers = rig_numbers(previewed(PreviewSize(30, 4), count=(90, 60)).job.spec.rig)
    assert (numbers.lens_rows, numbers.lens_cols, numbers.rows_px, numbers.cols_px) == (30, 20, 120, 80)
    assert numbers.pitch_mm == pytest.approx(3.0)


def test_lenses_that_would_be_too_large_are_refused_by_name() -> None:
    with pytest.raises(SpecError) as refused:
        previewed(PreviewSize(1), count=(90, 90), lens_array={"pitch_mm": 20.0, "focal_length_mm": 66.0})
    assert [problem.field for problem in refused.value.problems] == ["rig.lens_array.pitch_mm"]
