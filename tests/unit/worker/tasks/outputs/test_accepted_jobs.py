"""A job that is accepted can be made: outputs of every kind, over both lattices and many sizes, from given masters.

Options are drawn from the fields of each kind's own class, so a new kind takes part as soon as it is registered.
More examples: `HYPOTHESIS_PROFILE=many pytest tests/unit/worker/tasks/outputs/test_accepted_jobs.py`.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Mapping
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from pydantic.fields import FieldInfo

from lippmann.errors import SpecError
from lippmann.job.optics.rig import Rig
from lippmann.job.outputs.output import KINDS
from lippmann.lightfield.sheet.orthoscopic import orthoscopic
from lippmann.optics.rig.check import check_job
from lippmann.plan import artifact_names as names
from tests.builders_outputs import GivenJob, given_job
from worker.images.write import write_exr
from worker.tasks.frames.assemble import on_device
from worker.tasks.frames.render import header
from worker.tasks.local import JOB_ID

MANY = os.environ.get("HYPOTHESIS_PROFILE") == "many"

CHEAP: Mapping[str, st.SearchStrategy[Any]] = {
    "size_px": st.integers(1, 40),
    "rays": st.integers(1, 3),
    "seconds": st.sampled_from([0.1, 0.3]),
    "planes": st.integers(2, 5),
    "repeat": st.integers(1, 2),
    "periods": st.integers(1, 2),
    "scale": st.sampled_from([1, 2, 3]),
    "view_px": st.integers(1, 3),
    "gap_px": st.integers(0, 5),
    "margin_mm": st.sampled_from([0.0, 12.0, 15.0]),
    "length_mm": st.sampled_from([5.0, 20.0]),
    "strip_mm": st.sampled_from([1.0, 2.0]),
    "steps": st.sampled_from([3, 4]),
    "dpi": st.sampled_from([50.0, 100.0, 200.0]),
    "pitch_um": st.sampled_from([150.0, 400.0]),
    "codec": st.sampled_from(["h264", "h265", "av1", "vp9", "ffv1"]),
    "frame": st.integers(1, 3),
    "frames": st.sampled_from(["1", "1-2", "2", "3"]),
    "fps": st.sampled_from([1.0, 8.0, 24.0]),
    "views_per_s": st.sampled_from([8.0, 24.0]),
    "name": st.just("asked"),
    "sequence": st.just("Fish-2"),
}
"""Values of options that would otherwise take long, or that have a form of their own."""


def _values(name: str, kind: Any, bounds: tuple[Any, ...] = ()) -> st.SearchStrategy[Any]:
    """Return values of a field's type: numbers about the sizes of the arrays here, and now and then far beyond."""
    if name in CHEAP:
        return CHEAP[name] if NoneType not in get_args(kind) else st.none() | CHEAP[name]
    origin = get_origin(kind)
    if origin is Annotated:
        inner, *more = get_args(kind)
        return _values(name, inner, (*bounds, *more))
    if origin in (Union, UnionType):
        return st.one_of([_values(name, part, bounds) for part in get_args(kind)])
    if origin is Literal:
        return st.sampled_from(get_args(kind))
    if origin is tuple:
        parts = get_args(kind)
        if parts[1:] == (Ellipsis,):
            return st.lists(_values(name, parts[0]), max_size=3)
        return st.tuples(*(_values(name, part) for part in parts))
    if kind is NoneType:
        return st.none()
    if kind is bool:
        return st.booleans()
    if kind is int:
        return st.integers(0, 8) | st.sampled_from([16, 100])
    if kind is float:
        sizes = [0.25, 0.5, 1.0, 2.0, 3.3, 5.0, 20.0, 63.0, 250.0, 1000.0, 1e5]
        return st.sampled_from([0.0, *sizes, *(-size for size in sizes)])
    raise AssertionError(f"expected a strategy for {name}, of type {kind}")


def _option(name: str, field: FieldInfo) -> st.SearchStrategy[Any]:
    return _values(name, field.annotation, tuple(field.metadata))


@st.composite
def _outputs(draw: st.DrawFn, kind: str) -> dict[str, Any]:
    """Draw an output of a kind: some of its options, the others as they are when not given."""
    fields = {name: field for name, field in KINDS[kind].model_fields.items() if name not in ("kind", "name")}
    chosen = draw(st.sets(st.sampled_from(sorted(fields)), max_size=3)) if fields else set()
    options = {name: draw(_option(name, fields[name])) for name in sorted(chosen)}
    # What a clip costs is drawn always: four seconds of pictures take long.
    for name in ("seconds", "planes", "rays", "size_px", "length_mm", "strip_mm", "steps", "scale", "dpi"):
        if name in fields and name not in options and not (name == "dpi" and "pitch_um" in options):
            options[name] = draw(CHEAP[name])
    return {"kind": kind, "name": "asked", **options}


@st.composite
def _rigs(draw: st.DrawFn) -> dict[str, Any]:
    lattice = draw(st.sampled_from(["square", "hexagonal"]))
    array = {
        "lattice": lattice,
        "count": [draw(st.integers(1, 7)), draw(st.integers(1, 7))],
        "pitch_mm": draw(st.sampled_from([1.0, 0.5])),
        "offset_mm": draw(st.sampled_from([40.0, 10.0, -10.0])),
    }
    n = draw(st.sampled_from([2, 4, 6, 8]) if lattice == "hexagonal" else st.sampled_from([2, 3, 4, 5, 8]))
    rig: dict[str, Any] = {"lens_array": array, "px_per_lens": n}
    if draw(st.booleans()):
        rig["device"] = draw(st.sampled_from([{"dpi": 203}, {"dpi": 600, "margin_px": 3}, {"pitch_um": 200}]))
    return rig


@st.composite
def _jobs(draw: st.DrawFn, kind: str) -> dict[str, Any]:
    display = draw(st.sampled_from([{}, {"viewing_distance_mm": 100.0}, {"viewing_distance_mm": 1e5}]))
    frames, moving = draw(st.sampled_from([("1", None), ("1", None), ("1-2", None), ("1-2", 1.5), ("1-2", 6.0)]))
    rig = draw(_rigs())
    if moving is not None:
        rig["lens_array"]["focal_length_mm"] = {"keyframes": [[1, 3.3], [2, moving]]}
    return {"rig": rig, "frames": frames, "display": display, "outputs": [draw(_outputs(kind))]}


def _accepted(folder: Path, asked: Mapping[str, Any]) -> GivenJob | None:
    """Return the job with all its masters, or None if it is refused when it arrives."""
    rig = dict(asked["rig"])
    array = rig.pop("lens_array")
    more = {name: value for name, value in asked.items() if name != "rig"}
    try:
        job = given_job(
            folder, count=array["count"], lens_array=array, px_per_lens=rig.pop("px_per_lens"), rig=rig, **more
        )
        check_job(job.sheet)
    except SpecError as refused:
        if not all(problem.field and problem.expected and problem.got for problem in refused.problems):
            raise
        return None
    for frame in job.sheet.spec.frame_numbers:
        _keep_other_masters(folder, job, job.sheet.spec.rig, frame)
    return job


def _keep_other_masters(folder: Path, job: GivenJob, rig: Rig, frame: int) -> None:
    upright = job.stored_sheet(frame)
    others = {names.integral_name(frame): orthoscopic(upright, job.layout)}
    if rig.device is not None:
        pitch_mm = rig.lens_array.pitch_mm
        others[names.device_name(frame)] = on_device(upright, job.layout, rig.device, pitch_mm=pitch_mm)
    for name, picture in others.items():
        write_exr(folder / "other.exr", np.asarray(picture), attributes=header(job.sheet, frame))
        job.place.store.put_file(names.job_artifact(JOB_ID, name), folder / "other.exr")


def _hexagonal(count: tuple[int, int], n: int, output: dict[str, Any]) -> dict[str, Any]:
    rig = {"lens_array": {"lattice": "hexagonal", "count": list(count)}, "px_per_lens": n}
    return {"rig": rig, "frames": "1", "display": {}, "outputs": [{"name": "asked", **output}]}


CORNERS = {"kind": "anaglyph", "views": [[0, 0], [3, 4]]}
TOP_ROW = {"kind": "quilt", "view_row": 0}
FAR_FOCUS = {"kind": "focus", "from_mm": -50.0, "to_mm": 45.0, "seconds": 0.1, "planes": 3}


@pytest.mark.parametrize("kind", sorted(KINDS))
def test_what_is_accepted_can_be_made(kind: str) -> None:
    @settings(
        max_examples=200 if MANY else 8, derandomize=not MANY, database=None,
        suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much],
    )  # fmt: skip
    @given(asked=_jobs(kind))
    def made(asked: dict[str, Any]) -> None:
        make_if_accepted(asked)

    made()


EDGE_ESTIMATE = {"kind": "depth", "source": "estimate"}
ALL_ESTIMATES = {"kind": "hci", "disparity": "estimate", "disparity_of": "all"}


@pytest.mark.parametrize(
    "output", [CORNERS, TOP_ROW, FAR_FOCUS, EDGE_ESTIMATE, ALL_ESTIMATES], ids=lambda output: str(output["kind"])
)
@pytest.mark.parametrize(("count", "n"), [((6, 5), 4), ((1, 3), 2), ((5, 5), 8)])
def test_what_once_failed_after_the_render_is_refused_or_made(
    count: tuple[int, int], n: int, output: dict[str, Any]
) -> None:
    make_if_accepted(_hexagonal(count, n, output))


def make_if_accepted(asked: Mapping[str, Any]) -> bool:
    """Make the job's output, if the job is accepted; return True if it was."""
    with tempfile.TemporaryDirectory() as folder:
        job = _accepted(Path(folder), asked)
        if job is None:
            return False
        job.make(job.sheet.spec.outputs[0].file_name)
    return True
