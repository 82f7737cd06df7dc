"""True disparity in folders of the HCI benchmark: whose it is, its sign, its size, and depth by the tools' formula."""

from __future__ import annotations

from configparser import ConfigParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from lippmann.job.optics.rig import Rig
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.depth.depth_map import CHANNELS
from lippmann.plan import artifact_names as names
from lippmann.plan.sampling import display_size
from tests.builders_coded import read_pfm
from tests.builders_outputs import GivenJob, given_job
from tests.srgb import linear_of
from tests.unit.worker.exports.test_geometry import tools_disparity
from worker.images.write import write_channels
from worker.tasks.local import JOB_ID


def sheet_from(layout: CellLayout, pixel: Any, channels: int) -> NDArray[np.float64]:
    """Return the orthoscopic sheet whose view (u, v) is `pixel(u, v, lens_row, lens_col)`."""
    sheet = np.full((layout.rows, layout.cols, channels), np.nan)
    for v, u, lens_row, lens_col in np.ndindex(layout.cell_rows, layout.cell_cols, layout.lens_rows, layout.lens_cols):
        row = lens_row * layout.row_px + layout.cell_rows - 1 - v
        col = layout.shift_px(lens_row) + lens_col * layout.px_per_lens + layout.cell_cols - 1 - u
        if layout.mask[v, u]:
            sheet[row, col] = pixel(u, v, lens_row, lens_col)
    return sheet


def job_with_depth(folder: Path, output: dict[str, Any], light: Any, disparity: Any, **array: Any) -> GivenJob:
    """Return a job of 5 px (hexagonal: 4) under 6 x 9 lenses, whose light and disparity are given by view and lens."""
    px = 4 if array.get("lattice") == "hexagonal" else 5
    rig = Rig.model_validate({"lens_array": {"count": [6, 9], **array}, "px_per_lens": px})
    layout = display_size(rig)
    job = given_job(
        folder,
        {1: np.nan_to_num(sheet_from(layout, light, 3))},
        count=(6, 9),
        px_per_lens=px,
        lens_array=array,
        outputs=[output],
        capture={"depth": True},
    )
    depth = sheet_from(layout, lambda *at: (-1.0, -2.0, disparity(*at), -3.0), len(CHANNELS))
    size = (layout.rows, layout.cols)
    write_channels(folder / "depth.exr", [depth.astype(np.float32)], CHANNELS, size=size, attributes={})
    job.place.store.put_file(names.job_artifact(JOB_ID, names.depth_name(1)), folder / "depth.exr")
    return job


def grey(code: float) -> NDArray[np.float64]:
    return np.repeat(linear_of(np.array([code / 255])), 3)


def coded(u: int, v: int, lens_row: int, lens_col: int) -> float:
    return u + 10 * v + (lens_row * 9 + lens_col) / 64


def read(job: GivenJob, name: str) -> NDArray[np.float32]:
    with job.file(f"exports/hci/0001/{name}.pfm") as path:
        return read_pfm(path)


def test_every_view_has_its_own_disparity_and_the_plain_file_is_the_middle_cameras(tmp_path: Path) -> None:
    job = job_with_depth(tmp_path, {"kind": "hci", "disparity_of": "all"}, lambda *_: grey(9), coded)
    job.make("hci")
    for number in range(25):
        v, u = divmod(number, 5)
        expected = [[coded(u, v, row, col) for col in range(9)] for row in range(6)]
        np.testing.assert_array_equal(read(job, f"gt_disp_lowres_Cam{number:03d}"), expected)
    np.testing.assert_array_equal(read(job, "gt_disp_lowres"), read(job, "gt_disp_lowres_Cam012"))
    with job.file("exports/hci/0001/parameters.cfg") as path:
        text = path.read_text()
    parser = ConfigParser()
    parser.read_string(text)
    assert (parser.getfloat("meta", "disp_min"), parser.getfloat("meta", "disp_max")) == (-0.1, 45.0)
    depth = read(job, "gt_depth_lowres_Cam003")
    told = [tools_disparity(text, float(z)) for z in depth.ravel()]
    # Depths of 100 m in single precision come in steps of 0.008 mm, and 3.3 mm x 5 make one pixel of disparity.
    np.testing.assert_allclose(told, read(job, "gt_disp_lowres_Cam003").ravel(), atol=1e-3)


def test_a_point_is_found_by_its_disparity_further_left_in_the_next_view_on_the_right(tmp_path: Path) -> None:
    # A plane two lenses a view in front of the display: column x of view u shows what view 0 shows at x + 2 u.
    job = job_with_depth(tmp_path, {"kind": "hci"}, lambda u, v, row, col: grey(10 * (col + 2 * u)), lambda *_: 2.0)
    job.make("hci")
    disparity = read(job, "gt_disp_lowres")

    def camera(number: int) -> NDArray[np.int64]:
        with job.file(f"exports/hci/0001/input_Cam{number:03d}.png") as path, Image.open(path) as picture:
            return np.asarray(picture)[..., 0].astype(np.int64)

    here, right = camera(12), camera(13)
    for col in range(2, 9):
        np.testing.assert_array_equal(right[:, col - int(disparity[0, col])], here[:, col])


def test_where_no_surface_is_seen_both_maps_say_so_and_the_range_is_of_the_others(tmp_path: Path) -> None:
    job = job_with_depth(
        tmp_path, {"kind": "hci"}, lambda *_: grey(9), lambda u, v, row, col: np.nan if row == 0 else 0.5
    )
    job.make("hci")
    for name in ("gt_disp_lowres", "gt_depth_lowres"):
        assert np.isnan(read(job, name)[0]).all()
        assert np.isfinite(read(job, name)[1:]).all()
    assert "gt_disp_lowres.pfm" in job.sidecar("hci")["format"]["disparity"]


def test_hexagonal_disparity_is_of_one_lens_never_between_two(tmp_path: Path) -> None:
    job = job_with_depth(tmp_path, {"kind": "hci"}, lambda *_: grey(9), coded, lattice="hexagonal")
    job.make("hci")
    found = read(job, "gt_disp_lowres")
    assert found.shape == job.layout.square_size()
    u, v = job.layout.cell_cols // 2, job.layout.cell_rows // 2
    assert set(found.ravel().tolist()) <= {coded(u, v, row, col) for row in range(6) for col in range(9)}
    # From the left to the right and from the top down, lens numbers rise.
    assert (np.diff(found, axis=1) > 0).all()
    assert (np.diff(found, axis=0) > 0).all()


def test_a_folder_without_disparity_has_none(tmp_path: Path) -> None:
    job = job_with_depth(tmp_path, {"kind": "hci", "disparity": "none"}, lambda *_: grey(9), coded)
    job.make("hci")
    assert not any(name.endswith(".pfm") for name in job.sidecar("hci")["files"])
    assert job.sidecar("hci")["format"]["disparity"] is None


@pytest.mark.parametrize("word", ["truth", None])
def test_truth_that_the_job_has_is_written_whether_or_not_it_is_named(tmp_path: Path, word: str | None) -> None:
    job = job_with_depth(tmp_path, {"kind": "hci", "disparity": word}, lambda *_: grey(9), coded)
    job.make("hci")
    pfm = [Path(name).name for name in job.sidecar("hci")["files"] if name.endswith(".pfm")]
    assert pfm == ["gt_disp_lowres.pfm", "gt_depth_lowres.pfm"]


def test_an_estimate_is_found_without_depth_and_is_not_called_ground_truth(tmp_path: Path) -> None:
    noise = np.random.default_rng(4).integers(20, 236, (10, 13))
    job = job_with_depth(
        tmp_path,
        {"kind": "hci", "disparity": "estimate"},
        lambda u, v, row, col: grey(noise[row + v, col + u]),  # one lens a view, in front
        lambda *_: np.nan,
    )
    job.make("hci")
    pfm = [Path(name).name for name in job.sidecar("hci")["files"] if name.endswith(".pfm")]
    assert pfm == ["estimate_disp_lowres.pfm", "estimate_depth_lowres.pfm"]
    assert "estimated" in job.sidecar("hci")["format"]["disparity"]
    found = read(job, "estimate_disp_lowres")
    assert found.shape == (6, 9)
    assert np.nanmedian(found) == pytest.approx(1.0, abs=0.1)
