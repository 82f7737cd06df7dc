"""Whatever is asked for, sensible or silly: a design that JSON can hold and a drawing, or a field that is wrong."""

from __future__ import annotations

import json
import re
import time
import tomllib
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from lippmann.errors import SpecError
from lippmann.job.optics.rig import Rig
from lippmann.job.resolved import ResolvedJob
from lippmann.job.scenes.scene import SceneManifest
from lippmann.job.spec import parse_spec
from lippmann.optics.lens.prescription import IMAGING_LENSES
from lippmann.optics.rig.bench import bench
from lippmann.plan.design.designer import design, drawing
from lippmann.plan.design.lens import lens_numbers
from povtemplates.catalogue import scene_folders

FISH = SceneManifest.model_validate(tomllib.loads((scene_folders()["fish"] / "scene.toml").read_text()))
DRAWING_S = 3.0
"""CPU, thirty times what the longest takes: a search without end took ten times more than this."""

HOLLOW = [
    {"radius_mm": -200, "thickness_mm": 5, "index": 1.5, "semi_aperture_mm": 40},
    {"radius_mm": 200, "index": 1, "semi_aperture_mm": 40},
]
PLATE = [
    {"radius_mm": None, "thickness_mm": 5, "index": 1.5, "semi_aperture_mm": 40},
    {"radius_mm": None, "index": 1, "semi_aperture_mm": 40},
]
FRONT_FOCUS_MM = 56.55572355708
LENGTHS_MM = st.sampled_from(
    [1e-9, 1e-6, 0.5, 3.3, 40.0, 50.0, FRONT_FOCUS_MM, 57.0, 999.0, 1000.0, 1001.0, 2500.0, 1e6, 1e9, 1e300]
)
OFFSETS_MM = st.sampled_from([-1e6, -1000.0, -20.0, 0.0, 1e-9, 1.0, 40.0, 184.0, 1e6])


def some(**fields: st.SearchStrategy[Any]) -> st.SearchStrategy[dict[str, Any]]:
    """Return dicts that have any of these."""
    return st.fixed_dictionaries({}, optional=fields)


SURFACES = st.lists(
    st.fixed_dictionaries(
        {
            "radius_mm": st.sampled_from([None, 1e-3, 30.0, 50.0, 200.0, -30.0, -50.0, -200.0, 1e6, -1e6]),
            "thickness_mm": st.sampled_from([0.0, 1e-9, 1.0, 5.0, 20.0, 100.0, 1e6]),
            "index": st.sampled_from([1.0, 1.5, 1.8, 4.0]),
            "semi_aperture_mm": st.sampled_from([1e-9, 0.1, 5.0, 10.0, 29.0, 1e6]),
        },
        optional={"conic": st.sampled_from([-1000.0, -1.0, 0.5]), "aspheric": st.sampled_from([(1e-7,), (0.0, 1e-12)])},
    ),
    min_size=1,
    max_size=4,
)
LENSES = st.one_of(
    st.none(),
    st.sampled_from(sorted(IMAGING_LENSES)),
    st.builds(
        lambda name, focal_length_mm: {"name": name, "focal_length_mm": focal_length_mm},
        st.sampled_from(sorted(IMAGING_LENSES)),
        st.sampled_from([1e-6, 1.0, 50.0, 300.0, 1e5]),
    ),
    st.builds(
        lambda surfaces, stop: (
            {"surfaces": [*surfaces[:-1], surfaces[-1] | {"index": 1.0, "thickness_mm": 0.0}]} | stop
        ),
        SURFACES,
        some(stop_z_mm=st.sampled_from([-1e6, -5.0, 0.0, 1.0, 30.0, 1e6])),
    ),
)
ARRAYS = some(
    count=st.sampled_from([(1, 1), (1, 5), (7, 6), (90, 90), (4096, 4096)]),
    pitch_mm=st.sampled_from([1e-9, 0.01, 1.0, 1.5, 1000.0]),
    focal_length_mm=st.sampled_from([1e-9, 1.0, 3.3, 1e4]),
    index=st.sampled_from([1 + 1e-12, 1.49, 4.0]),
    lattice=st.sampled_from(["square", "hexagonal"]),
    aperture=st.sampled_from(["full", "inscribed"]),
    offset_mm=OFFSETS_MM,
    substrate_mm=st.sampled_from([0.0, 3.3, 1000.0]),
)
RIGS = some(
    imaging_lens=LENSES,
    f_number=st.sampled_from([0.5, 1.5, 4.0, 1e4]),
    stop_mm=st.sampled_from([1e-9, 1.0, 20.0, 1e4]),
    lens_array=ARRAYS,
    camera=some(
        projection=st.sampled_from(["orthographic", "perspective"]), angle_deg=st.sampled_from([0.001, 6.7, 89.9])
    ),
    px_per_lens=st.sampled_from([2, 3, 8, 512]),
    device=some(
        dpi=st.sampled_from([1e-9, 203, 600, 1e5]), margin_px=st.sampled_from([0, 7]), window_px=st.just((2400, 2400))
    ),
)
JOBS = some(
    stage=some(near_mm=LENGTHS_MM, reference_mm=LENGTHS_MM, far_mm=LENGTHS_MM),
    rig=RIGS,
    display=some(
        gap_real_mm=st.sampled_from([1e-9, 3.3, 4.8, 1e4]),
        gap_virtual_mm=st.sampled_from([1e-9, 3.3, 1e4]),
        viewing_distance_mm=st.sampled_from([1e-9, 78.0, 1000.0, 1e6]),
    ),
)
STAGED = st.builds(
    lambda planes, lens, offset: {
        "stage": dict(zip(("near_mm", "reference_mm", "far_mm"), sorted(planes), strict=True)),
        "rig": {"imaging_lens": lens, "lens_array": {"offset_mm": offset}},
    },
    st.lists(LENGTHS_MM, min_size=3, max_size=3),
    st.one_of(st.none(), st.sampled_from(sorted(IMAGING_LENSES))),
    OFFSETS_MM,
)
ONE_CHANGED = st.one_of(
    JOBS.map(lambda job: {"stage": job.get("stage", {})}),
    RIGS.map(lambda rig: {"rig": dict(list(rig.items())[:2])}),
    ARRAYS.map(lambda array: {"rig": {"lens_array": dict(list(array.items())[:2])}}),
    LENSES.map(lambda lens: {"rig": {"imaging_lens": lens, "lens_array": {"offset_mm": 1.0}}}),
    JOBS.map(lambda job: {"display": job.get("display", {})}),
)


@pytest.mark.parametrize("jobs", [STAGED, JOBS, ONE_CHANGED], ids=["planes", "all", "one part"])
def test_any_job_has_a_design_and_a_drawing_or_is_told_what_is_wrong(jobs: st.SearchStrategy[dict[str, Any]]) -> None:
    @settings(max_examples=100, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
    @given(jobs)
    def tried(job: dict[str, Any]) -> None:
        assert_designed_or_refused(job)

    tried()


@pytest.mark.parametrize(
    "job",
    [
        {"stage": {"far_mm": 1e308}},
        {"stage": {"far_mm": 1e9, "reference_mm": 1e9}},
        {"stage": {"reference_mm": 1e300}},
        {"stage": {"near_mm": FRONT_FOCUS_MM}},
        {"stage": {"near_mm": FRONT_FOCUS_MM, "far_mm": FRONT_FOCUS_MM, "reference_mm": FRONT_FOCUS_MM}},
        {"stage": {"near_mm": 1000.0, "far_mm": 1000.0}},
        {"rig": {"imaging_lens": {"surfaces": HOLLOW}}},
        {"rig": {"imaging_lens": {"surfaces": PLATE}}},
        {"rig": {"stop_mm": 1e-9}},
        {"rig": {"lens_array": {"count": [4096, 4096]}}},
        {"rig": {"imaging_lens": {"name": "double-gauss-tronnier", "focal_length_mm": 1000}}},
    ],
    ids=str,
)
def test_jobs_at_the_end_of_what_can_be_are_designed_or_refused(job: dict[str, Any]) -> None:
    assert_designed_or_refused(job)


def test_a_plane_without_end_has_an_image_and_no_point_that_is_shown_at_the_edge() -> None:
    """No job has one; the reckoning does not need to know."""
    stage = FISH.stage.model_copy(update={"far_mm": 1e308})
    with np.errstate(all="ignore"):  # the length's square is too large
        found = lens_numbers(bench(Rig(), reference_mm=stage.reference_mm), stage)
    assert found["image_far_mm"] == pytest.approx(98.8926, abs=0.01)
    assert found["spot_far_edge_mm"] is None


def assert_designed_or_refused(job: dict[str, Any]) -> None:
    try:
        sheet = ResolvedJob.of("any", parse_spec({"scene": "fish", **job}), FISH, bundle="")
        found = design(sheet)
    except SpecError:
        return
    json.dumps(found.model_dump(mode="json"), allow_nan=False)
    begun_s = time.process_time()
    shown = drawing(sheet)
    assert time.process_time() - begun_s < DRAWING_S
    ET.fromstring(shown)
    assert not re.search(r"[\s,=\"-](nan|inf)\b", re.sub(r"<(title|desc|style|text).*?</\1>", "", shown))
