"""Normals, albedo and objects in data sets: those of the view and the lens, with the names of the objects."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lippmann.errors import OutputError
from lippmann.job.rendering.channels import channel_attributes, part_names
from lippmann.job.rendering.render_settings import Channel
from lippmann.plan import artifact_names as names
from lippmann.plan.sampling import display_size
from tests.builders import small_job
from tests.builders_coded import read_pfm
from tests.builders_outputs import GivenJob, given_job
from tests.unit.worker.tasks.outputs.test_dataset_disparity import sheet_from
from worker.images.write import write_channels
from worker.tasks.local import JOB_ID
from worker.tasks.outputs.frame_source import job_frames

CHANNELS: tuple[Channel, ...] = ("normal", "albedo", "object")


def coded(u: int, v: int, lens_row: int, lens_col: int) -> tuple[float, ...]:
    """Return a normal, an albedo and an object that differ from view to view and from lens to lens."""
    return (u / 8, v / 8, lens_row / 8, lens_col / 16, u / 16, v / 16, 10 * lens_row + lens_col + 1)


def job_with_channels(folder: Path, outputs: list[Any], *, lattice: str = "square") -> GivenJob:
    wanted: dict[str, Any] = {
        "count": (6, 9), "px_per_lens": 4, "lens_array": {"lattice": lattice}, "outputs": outputs,
        "capture": {"channels": CHANNELS},
    }  # fmt: skip
    layout = display_size(small_job("turning-knot", **wanted).rig)
    job = given_job(folder, {1: np.zeros((layout.rows, layout.cols, 3))}, scene="turning-knot", **wanted)
    values = sheet_from(layout, coded, 7).astype(np.float32)
    attributes = channel_attributes(CHANNELS, ("fish", "Wasser ü"))
    size = (layout.rows, layout.cols)
    write_channels(folder / "c.exr", [values], part_names(CHANNELS), size=size, attributes=attributes)
    job.place.store.put_file(names.job_artifact(JOB_ID, names.channels_name(1)), folder / "c.exr")
    return job


@pytest.mark.parametrize("lattice", ["square", "hexagonal"])
def test_an_npz_has_the_channels_of_every_view_at_their_lenses(tmp_path: Path, lattice: str) -> None:
    job = job_with_channels(tmp_path, [{"kind": "npz", "pixels": "lenses"}], lattice=lattice)
    job.make("npz.npz")
    with job.file("exports/npz/0001.npz") as path, np.load(path) as read:
        arrays = dict(read)
    assert arrays["normal"].dtype == np.float32
    for v, u, row, col in np.ndindex(*arrays["object"].shape):
        got = (*arrays["normal"][v, u, row, col], *arrays["albedo"][v, u, row, col], arrays["object"][v, u, row, col])
        if arrays["exists"][v, u]:
            assert got == coded(u, v, row, col)
        else:
            assert np.isnan(got[:6]).all()
            assert got[6] == 0
    assert json.loads(str(arrays["meta_json"]))["objects"] == ["fish", "Wasser ü"]
    assert "unit vector" in job.sidecar("npz.npz")["format"]["normal"]
    assert "z_mm" not in arrays


def test_square_pixels_of_a_hexagonal_lattice_mix_no_two_surfaces(tmp_path: Path) -> None:
    job = job_with_channels(tmp_path, ["npz.npz"], lattice="hexagonal")
    job.make("npz.npz")
    with job.file("exports/npz/0001.npz") as path, np.load(path) as read:
        objects = read["object"]
        assert objects.shape[2:] == read["views"].shape[2:4] == job.layout.square_size()
    assert set(objects.ravel().tolist()) <= {0.0, *(10.0 * row + col + 1 for row in range(6) for col in range(9))}


def test_an_hci_folder_has_the_channels_of_the_middle_camera_and_the_names(tmp_path: Path) -> None:
    job = job_with_channels(tmp_path, [{"kind": "hci"}, {"kind": "hci", "name": "all", "disparity_of": "all"}])
    job.make("hci")
    job.make("all")
    expected = np.array([[coded(2, 2, row, col) for col in range(9)] for row in range(6)], dtype=np.float32)
    for folder, stem in (("hci", "lowres"), ("all", "lowres_Cam004")):  # 3 x 3 of 4 x 4 views: 1 to 3
        for name, part in (("normal", expected[..., :3]), ("albedo", expected[..., 3:6]), ("object", expected[..., 6])):
            with job.file(f"exports/{folder}/0001/{name}_{stem}.pfm") as path:
                np.testing.assert_array_equal(read_pfm(path), part)
    with job.file("exports/hci/0001/objects.json") as path:
        assert json.loads(path.read_text()) == {"1": "fish", "2": "Wasser ü"}
    assert set(job.sidecar("hci")["format"]["channels"]) == set(CHANNELS)


def test_a_channel_that_the_job_does_not_have_is_refused_by_name(tmp_path: Path) -> None:
    job = given_job(tmp_path, scene="turning-knot", capture={"channels": ["normal"]})
    with pytest.raises(OutputError, match=r"expected a job with albedo in capture\.channels, got one without"):
        job_frames(job.artifacts, job.sheet).channel(1, "albedo")
