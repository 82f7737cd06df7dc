"""Where cameras and lenses stand, as the files say it, against where pixels really lie."""

from __future__ import annotations

from configparser import ConfigParser
from xml.etree import ElementTree

import numpy as np
import pytest
from numpy.typing import NDArray

from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.refocus.shift_and_sum import shifts
from lippmann.lightfield.sheet.cells import sheet_of
from worker.exports.hci_parameters import Cameras, disparity_range, parameters_cfg
from worker.exports.ray_calibration import calibration_xml, lens_grid

CAMERAS = Cameras(
    rows_px=80,
    cols_px=90,
    views_down=7,
    views_across=5,
    pitch_mm=1.0,
    pixel_mm=1 / 8,
    gap_mm=3.3,
    scene="100% fish",
    category="lippmann",
    version="1",
    disparities=(-0.5, 1.5),
)


def tools_disparity(cfg: str, depth_m: float) -> float:
    """Return the disparity that the benchmark's own formula gives for a depth, from nothing but the file."""
    parser = ConfigParser(interpolation=None)
    parser.read_string(cfg)
    longest = max(parser.getint("intrinsics", f"image_resolution_{axis}_px") for axis in "xy")
    baseline_m = parser.getfloat("extrinsics", "baseline_mm") / 1000
    factor = baseline_m * parser.getfloat("intrinsics", "focal_length_mm") * longest
    focus_m = parser.getfloat("extrinsics", "focus_distance_m")
    return factor * (1 / depth_m - 1 / focus_m) / parser.getfloat("intrinsics", "sensor_size_mm")


@pytest.mark.parametrize("s_mm", [-60.0, -1.0, 0.0, 5.0, 40.0])
def test_the_benchmarks_formula_gives_the_small_angle_law_in_the_displays_depths(s_mm: float) -> None:
    _, across = shifts(CellLayout(80, 90, 8), s_mm, focal_mm=3.3)
    told = tools_disparity(parameters_cfg(CAMERAS), 100 - s_mm / 1000)
    assert told == pytest.approx(across, rel=1e-3, abs=1e-9)
    assert CAMERAS.depth_m(np.array([told]))[0] == pytest.approx(100 - s_mm / 1000, abs=1e-9)


def test_the_keys_of_the_benchmarks_scenes_are_all_there() -> None:
    parser = ConfigParser(interpolation=None)
    parser.read_string(parameters_cfg(CAMERAS))
    assert (parser.getint("extrinsics", "num_cams_x"), parser.getint("extrinsics", "num_cams_y")) == (5, 7)
    assert parser["meta"]["scene"] == "100% fish"
    assert (parser.getfloat("meta", "disp_min"), parser.getfloat("meta", "disp_max")) == (-0.5, 1.5)
    # The keys of the scene dino, training, version 2.0.
    assert set(parser["intrinsics"]) == {
        *("focal_length_mm", "image_resolution_x_px", "image_resolution_y_px", "sensor_size_mm", "fstop"),
    }
    assert set(parser["extrinsics"]) == {
        *("num_cams_x", "num_cams_y", "baseline_mm", "focus_distance_m", "center_cam_x_m", "center_cam_y_m"),
        *("center_cam_z_m", "center_cam_rx_rad", "center_cam_ry_rad", "center_cam_rz_rad"),
    }
    assert set(parser["meta"]) == {
        *("scene", "category", "date", "version", "authors", "contact", "cycles_seed", "disp_min", "disp_max"),
        *("frustum_disp_min", "frustum_disp_max", "depth_map_scale"),
    }


def lens_middles(layout: CellLayout) -> NDArray[np.float64]:
    """Return (x, y) of every lens in px from the upper left corner, y down: the middle of its own pixels."""
    found = []
    for lens in np.ndindex(layout.lens_rows, layout.lens_cols):
        cells = np.zeros((layout.lens_rows, layout.lens_cols, layout.cell_rows, layout.cell_cols, 1))
        cells[lens] = 1
        rows, cols = np.nonzero(sheet_of(cells, layout)[..., 0])
        found.append((cols.mean() + 0.5, rows.mean() + 0.5))
    return np.array(found)


LAYOUTS = [
    CellLayout(3, 4, 5),
    CellLayout(4, 3, 4, "hexagonal"),
    CellLayout(5, 3, 6, "hexagonal"),
    CellLayout(5, 3, 6, "hexagonal", first_row_shifted=True),
]


@pytest.mark.parametrize("layout", LAYOUTS, ids=str)
def test_every_lens_lies_on_the_lattice_that_the_calibration_file_spans(layout: CellLayout) -> None:
    rows, cols = layout.rows + layout.rows % 2, layout.cols + layout.cols % 2
    root = ElementTree.fromstring(calibration_xml(lens_grid(layout, rows=rows, cols=cols), ours={"lattice": "any"}))
    assert root.tag == "RayCalibData"

    def pair(name: str) -> NDArray[np.float64]:
        return np.array([float(root.findtext(f"{name}/{axis}") or "nan") for axis in "xy"])

    diameter = float(root.findtext("diameter") or "nan")
    origin = pair("offset") * (1, -1) + (cols / 2, rows / 2)
    bases = np.stack((pair("lens_base_x"), pair("lens_base_y")), axis=-1) * [[1], [-1]] * diameter
    steps = np.linalg.solve(bases, (lens_middles(layout) - origin).T)
    np.testing.assert_allclose(steps, steps.round(), atol=1e-9)
    assert len({tuple(step) for step in steps.round().T.tolist()}) == layout.lens_rows * layout.lens_cols
    assert (np.abs(pair("offset")) <= layout.px_per_lens).all()
    assert root.findtext("lippmann/lattice") == "any"
    assert [kind.get("id") for kind in root.findall("lens_type")] == ["0"]


def test_the_range_of_disparities_is_rounded_outward_a_tenth_further() -> None:
    maps = [np.array([[0.31, np.nan]]), np.array([[-0.25, 1.2]]), np.full((1, 1), np.nan)]
    assert disparity_range(maps) == (-0.4, 1.3)
    assert disparity_range([]) == disparity_range(maps[2:]) == (0.0, 0.0)
