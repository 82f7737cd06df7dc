"""Bundles of integral images from elsewhere, and what a job of them may ask."""

from __future__ import annotations

from typing import Any

import pytest

from lippmann.errors import BundleError, SpecError
from lippmann.job.messages.events import ProbeResult
from lippmann.job.messages.orders import TaskKind
from lippmann.job.resolved import ResolvedJob
from lippmann.job.scenes.scene import SceneManifest, parse_scene
from lippmann.job.spec import JobSpec, parse_spec
from lippmann.optics.rig.check import check_job
from lippmann.plan.sampling import display_size, frame_size
from lippmann.plan.tasks import plan_sheet, plan_tasks
from tests.builders import small_job

SHEETS = {
    "files": ["frames/1.png", "frames/2.png"],
    "pitch_px": 11.4,
    "count": [20, 30],
    "px_per_lens": 12,
    "pitch_mm": 0.5,
}


def _card(**changes: Any) -> SceneManifest:
    return parse_scene({"sheets": SHEETS | changes})


def _sheet(job: dict[str, Any] | None = None, **changes: Any) -> ResolvedJob:
    return ResolvedJob.of("j", parse_spec({"scene": "mine"} | (job or {})), _card(**changes), bundle="b")


def test_the_rig_is_that_of_the_sheets_and_holds_what_the_job_says_in_mm() -> None:
    rig = _sheet().spec.rig
    assert (rig.lens_array.count, rig.px_per_lens, rig.imaging_lens) == ((20, 30), 12, None)
    assert rig.lens_array.pitch_mm == 0.5
    assert rig.lens_array.focal_length_mm == pytest.approx(3.3 * 0.5)
    said = _sheet({"rig": {"lens_array": {"pitch_mm": 0.7}, "device": {"dpi": 600}}}).spec.rig
    assert (said.lens_array.pitch_mm, said.px_per_lens) == (0.7, 12)
    assert frame_size(rig) == display_size(rig)


def test_a_job_that_is_asked_for_again_as_it_was_stored_is_the_same() -> None:
    stored = _sheet({"frames": "1-2"})
    assert _sheet(stored.spec.model_dump(mode="json")).spec == stored.spec
    assert ResolvedJob.model_validate_json(stored.model_dump_json()) == stored
    assert SceneManifest.model_validate(_card().model_dump(mode="json")) == _card()


def test_nothing_is_rendered_and_every_frame_is_assembled_at_once() -> None:
    spec = _sheet({"frames": "1-2", "outputs": ["views.mp4"]}).spec
    plan = plan_sheet(spec, ProbeResult(start_s=0, s_per_px=1e-6, tileable=False, renders=False), slots=4)
    tasks = list(plan_tasks(spec, plan))
    assert [task.kind for task in tasks] == [TaskKind.ASSEMBLE, TaskKind.ASSEMBLE, TaskKind.ENCODE]
    assert [task.needs for task in tasks] == [None, None, "assemble"]
    assert [task.sequence for task in tasks] == [1, 2, 3]
    assert tasks[0].weight_px == frame_size(spec.rig).px


def test_its_optics_are_not_checked() -> None:
    assert check_job(_sheet()) == ("Integral images from elsewhere: nothing is rendered.",)


@pytest.mark.parametrize(
    ("job", "field"),
    [
        ({"render": {"antialias": {"method": 1}}}, "render"),
        ({"capture": {"supersample": 2}}, "capture"),
        ({"stage": {"near_mm": 5}}, "stage"),
        ({"rig": {"imaging_lens": "double-gauss-tronnier"}}, "rig.imaging_lens"),
        ({"rig": {"camera": {"projection": "perspective"}}}, "rig.camera"),
        ({"rig": {"lens_array": {"count": [20, 31]}}}, "rig.lens_array.count"),
        ({"rig": {"px_per_lens": 8}}, "rig.px_per_lens"),
        ({"frames": "1-3"}, "frames"),
        ({"parameters": {"turn": 1}}, "parameters.turn"),
    ],
)
def test_what_only_a_rendered_job_can_be_asked_is_refused(job: dict[str, Any], field: str) -> None:
    with pytest.raises(SpecError) as caught:
        _sheet(job)
    assert [problem.field for problem in caught.value.problems] == [field]


@pytest.mark.parametrize("missing", ["count", "px_per_lens", "pitch_px"])
def test_a_bundle_must_say_how_large_its_sheets_are(missing: str) -> None:
    with pytest.raises(BundleError, match=f"sheets.{missing}: expected"):
        parse_scene({"sheets": {name: value for name, value in SHEETS.items() if name != missing}})


def test_hexagons_must_begin_with_a_row_that_is_not_shifted() -> None:
    with pytest.raises(BundleError, match=r"sheets\.count: expected lenses without the outermost row"):
        _card(lattice="hexagonal", first_row_shifted=True)
    assert _card(lattice="hexagonal", first_row_shifted=True, inverted=True, count=[21, 30]).sheets


def test_a_scene_is_none_of_these() -> None:
    with pytest.raises(BundleError, match="stage: expected a value"):
        parse_scene({"title": "no stage"})
    assert isinstance(small_job("fish"), JobSpec)
