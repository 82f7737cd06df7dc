"""The depth of a view as an output: colours, floats and PFM, true and estimated."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO
import pytest

from lippmann.errors import ArtifactMissing, SpecError
from lippmann.job.spec import parse_spec
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.depth.depth_map import CHANNELS
from lippmann.lightfield.views.views import view
from lippmann.plan import artifact_names as names
from tests.builders_outputs import GivenJob, given_job
from tests.pictures import read_png
from tests.unit.lippmann.lightfield.textures import sheet_of_texture
from worker.images.read import read_channels
from worker.images.write import write_channels
from worker.tasks.local import JOB_ID

LAYOUT = CellLayout(16, 15, 8)


def waves(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return 0.5 + 0.2 * np.sin(1.3 * x + 0.7 * y) + 0.2 * np.cos(0.9 * x - 1.5 * y)


def job_of(folder: Path, *outputs: dict[str, Any], has_depth: bool = True) -> GivenJob:
    """Return a job of waves 20 mm in front of the display, and, if it has, of a depth that says so."""
    sheet = sheet_of_texture(LAYOUT, waves, 20.0, focal_mm=3.3).repeat(3, axis=2)
    more = {"count": (16, 15), "px_per_lens": 8, "capture": {"depth": has_depth}}
    job = given_job(folder, {1: sheet}, outputs=[{"kind": "depth", **output} for output in outputs], **more)
    if has_depth:
        depth = np.full((LAYOUT.rows, LAYOUT.cols, 4), [1100.0, 20.0, 0.76, 0.76], dtype=np.float32)
        depth[:, : LAYOUT.cols // 2, 1] = -10.0
        depth[: LAYOUT.rows // 2] = np.nan
        write_channels(folder / "d.exr", (depth,), CHANNELS, size=(LAYOUT.rows, LAYOUT.cols), attributes={})
        job.place.store.put_file(names.job_artifact(JOB_ID, names.depth_name(1)), folder / "d.exr")
    return job


def test_the_truth_is_told_as_colours_warm_in_front_and_cold_behind(tmp_path: Path) -> None:
    job = job_of(tmp_path, {})
    job.make("depth.png")
    with job.file("exports/depth/0001.png") as path:
        codes = read_png(path).astype(int)
    assert codes.shape == (16, 15, 3)
    assert (codes[:8] == 0).all(), "unknown is black"
    behind, in_front = codes[8:, :7], codes[8:, 8:]
    assert (behind[..., 2] > behind[..., 0] + 50).all()
    assert (in_front[..., 0] > in_front[..., 2] + 50).all()
    said = job.sidecar("depth.png")
    assert said["files"] == ["exports/depth/0001.png"]


def test_the_truth_is_told_as_floats_that_another_reader_reads(tmp_path: Path) -> None:
    job = job_of(tmp_path, {"file_format": "exr", "u": 2, "v": 3})
    job.make("depth.exr")
    with job.file("exports/depth/0001.exr") as path, job.file(names.depth_name(1)) as master:
        expected = view(read_channels(master, CHANNELS), LAYOUT, 2, 3)
        picture = OpenImageIO.ImageBuf(str(path))
    assert set(picture.spec().channelnames) == {"s_mm", "disparity", "z_mm"}
    found = dict(zip(picture.spec().channelnames, np.moveaxis(np.asarray(picture.get_pixels()), -1, 0), strict=True))
    np.testing.assert_array_equal(found["s_mm"], expected[..., 1])
    np.testing.assert_array_equal(found["z_mm"], expected[..., 0])
    assert found["disparity"] == pytest.approx(expected[..., 1] / 26.4, nan_ok=True)


@pytest.mark.parametrize("method", ["tensor", "sweep"])
def test_the_estimate_needs_no_depth_of_the_job(tmp_path: Path, method: str) -> None:
    output = {"source": "estimate", "file_format": "pfm", "method": method, "farthest_mm": -30, "nearest_mm": 50}
    job = job_of(tmp_path, output, has_depth=False)
    job.make("depth.pfm")
    with job.file("exports/depth/0001.pfm") as path:
        header, values = path.read_bytes().split(b"-1\n", 1)
    assert header == b"Pf\n15 16\n"
    disparity = np.frombuffer(values, "<f4").reshape(16, 15)[::-1]
    assert np.median(disparity[4:-4, 4:-4]) == pytest.approx(20 / 26.4, abs=0.02)
    told = job.sidecar("depth.pfm")["format"]
    assert told["view"] == {"u": 4, "v": 4}
    assert told["rows"] == "from the bottom up"


def test_the_truth_that_is_gone_is_named_and_may_be_there_at_the_next_attempt(tmp_path: Path) -> None:
    job = job_of(tmp_path, {})
    job.place.store.delete(names.job_artifact(JOB_ID, "depth/"))
    with pytest.raises(ArtifactMissing, match=r"depth/0001\.exr"):
        job.make("depth.png")


@pytest.mark.parametrize(
    ("output", "field", "expected"),
    [
        ({}, "source", "capture.depth true"),
        ({"source": "estimate", "u": 3}, "v", "both or neither"),
        ({"source": "estimate", "u": 8, "v": 0}, "u", "a view from (0, 0) to (7, 7)"),
        ({"source": "estimate", "nearest_mm": 3}, "farthest_mm", "both or neither"),
        ({"source": "estimate", "nearest_mm": 3, "farthest_mm": 4}, "nearest_mm", "more than farthest_mm, 4"),
        ({"source": "estimate", "reach": 0}, "reach", "a number of at least 1"),
    ],
)
def test_what_cannot_be_is_refused_by_name(output: dict[str, Any], field: str, expected: str) -> None:
    with pytest.raises(SpecError) as refused:
        parse_spec({"scene": "fish", "outputs": [{"kind": "depth", **output}]})
    (problem,) = refused.value.problems
    assert problem.field.startswith("outputs.0")
    assert field in problem.field
    assert expected in problem.expected


def test_a_view_that_no_hexagon_has_is_refused() -> None:
    output = {"kind": "depth", "source": "estimate", "u": 0, "v": 0}
    with pytest.raises(SpecError, match=r"outputs\.0\.u: expected a view with v from 1 to 9"):
        parse_spec({"scene": "fish", "rig": {"lens_array": {"lattice": "hexagonal"}}, "outputs": [output]})
