"""Data sets as a job makes them, read back file by file: every view under its own name, every code exact."""

from __future__ import annotations

import json
from configparser import ConfigParser
from pathlib import Path
from typing import Any

import av
import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from lippmann.errors import Stopped
from lippmann.job.optics.rig import Rig
from lippmann.job.outputs.view_block import all_views, all_views_exist, block_about_the_middle, largest_odd_square
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.sheet.orthoscopic import orthoscopic
from lippmann.lightfield.views.light_field import light_field, on_square_pixels
from lippmann.lightfield.views.square_pixels import as_square
from lippmann.plan.sampling import display_size
from tests.builders_coded import coded_sheet, read_ppm, view_codes
from tests.builders_outputs import GivenJob, given_job
from tests.pictures import read_png
from tests.srgb import encoded_srgb, linear_of
from tests.unit.lippmann.lightfield.sheets import image_of
from tests.unit.worker.exports.test_files import bt709
from worker.tasks.local import JOB_ID

HEXAGONAL = {"lens_array": {"lattice": "hexagonal", "count": [7, 6]}, "px_per_lens": 8}
SQUARE = {"lens_array": {"count": [6, 5]}, "px_per_lens": 8}


def coded_job(folder: Path, outputs: list[Any], rig: dict[str, Any] = SQUARE, **more: Any) -> GivenJob:
    """Return a job of two frames whose views tell their numbers."""
    layout = display_size(Rig.model_validate(rig))
    sheets = {frame: coded_sheet(layout, view_codes(layout, of_lens=rig is SQUARE, frame=frame)) for frame in (1, 2)}
    frames = {"count": tuple(rig["lens_array"]["count"]), "px_per_lens": rig["px_per_lens"], "frames": "1-2"}
    array = {name: value for name, value in rig["lens_array"].items() if name != "count"}
    return given_job(folder, sheets, outputs=outputs, lens_array=array, **frames, **more)


def files_of(job: GivenJob, output: str) -> set[str]:
    folder = job.place.settings.artifacts_dir / JOB_ID / "exports" / output
    return {str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()}


def test_a_folder_of_the_hci_benchmark_has_its_views_row_by_row_from_the_upper_left(tmp_path: Path) -> None:
    job = coded_job(tmp_path, ["hci"])
    job.make("hci")
    names = {f"{frame:04d}/input_Cam{number:03d}.png" for frame in (1, 2) for number in range(49)}
    assert files_of(job, "hci") == names | {"0001/parameters.cfg", "0002/parameters.cfg"}
    for frame in (1, 2):
        codes = view_codes(job.layout, frame=frame)
        for number in range(49):
            told = codes[1 + number // 7, 1 + number % 7]
            with job.file(f"exports/hci/{frame:04d}/input_Cam{number:03d}.png") as path, Image.open(path) as picture:
                assert picture.mode == "RGB"
                assert np.abs(np.asarray(picture) - told / 1023 * 255).max() <= 0.5 + 0.01
    with job.file("exports/hci/0002/parameters.cfg") as path:
        parser = ConfigParser()
        parser.read(path)
    assert [parser.getint("extrinsics", f"num_cams_{axis}") for axis in "xy"] == [7, 7]
    assert [parser.getint("intrinsics", f"image_resolution_{axis}_px") for axis in "xy"] == [5, 6]
    said = job.sidecar("hci")["format"]
    assert said["middle_camera"] == "input_Cam024"
    assert said["first_view"] == {"u": 1, "v": 1}


def test_jpeg_plenos_names_are_column_then_row_and_the_codes_are_exact(tmp_path: Path) -> None:
    job = coded_job(tmp_path, [{"kind": "subaperture_ppm", "views": [4, 6]}])
    job.make("subaperture_ppm")
    names = {f"{frame:04d}/{u:03d}_{v:03d}.ppm" for frame in (1, 2) for u in range(6) for v in range(4)}
    assert files_of(job, "subaperture_ppm") == names
    codes = view_codes(job.layout, frame=2)
    for u, v in np.ndindex(6, 4):
        with job.file(f"exports/subaperture_ppm/0002/{u:03d}_{v:03d}.ppm") as path:
            read, highest = read_ppm(path)
        assert highest == 1023
        np.testing.assert_array_equal(read, codes[v + 2, u + 1])


def test_hexagonal_views_come_on_square_pixels_and_those_that_are_not_are_black(tmp_path: Path) -> None:
    job = coded_job(tmp_path, ["subaperture_ppm"], HEXAGONAL)
    job.make("subaperture_ppm")
    codes, mask = view_codes(job.layout, of_lens=False), job.layout.mask
    missing = set()
    for v, u in np.ndindex(mask.shape):
        with job.file(f"exports/subaperture_ppm/0001/{u:03d}_{v:03d}.ppm") as path:
            read, _ = read_ppm(path)
        assert read.shape[:2] == job.layout.square_size()
        if (read == 0).all():
            missing.add((u, v))
        else:
            np.testing.assert_array_equal(read, np.broadcast_to(codes[v, u, 0, 0], read.shape))
    assert missing == {(int(u), int(v)) for v, u in np.argwhere(~mask)}
    assert {tuple(view) for view in job.sidecar("subaperture_ppm")["format"]["missing_views"]} == missing


@pytest.mark.parametrize("dtype", ["float16", "float32"])
def test_an_npz_is_the_light_of_every_view_by_lens(tmp_path: Path, dtype: str) -> None:
    job = coded_job(tmp_path, [{"kind": "npz", "dtype": dtype}])
    job.make("npz.npz")
    for frame in (1, 2):
        with job.file(f"exports/npz/{frame:04d}.npz") as path, np.load(path, allow_pickle=False) as read:
            views, meta = read["views"], json.loads(str(read["meta_json"]))
        told = linear_of(view_codes(job.layout, frame=frame) / 1023)
        assert views.dtype == dtype
        np.testing.assert_array_equal(views, told.astype(np.float16).astype(dtype))
        assert meta["frame"] == frame
        assert meta["integral_image"]["pitch_px"] == 8


@pytest.mark.parametrize(("dtype", "highest"), [("uint8", 255), ("uint16", 65535)])
def test_whole_numbers_in_an_npz_are_srgb_codes(tmp_path: Path, dtype: str, highest: int) -> None:
    job = coded_job(tmp_path, [{"kind": "npz", "dtype": dtype, "views": [3, 5]}])
    job.make("npz.npz")
    with job.file("exports/npz/0001.npz") as path, np.load(path) as read:
        views, slopes = read["views"], (read["slope_right"], read["slope_down"])
    told = view_codes(job.layout)[3:6, 2:7] / 1023 * highest
    assert (views.shape, views.dtype) == (told.shape, dtype)
    # Half floats keep 11 bits of the light.
    np.testing.assert_allclose(views, told, atol=0.51 + highest * 3e-4)
    np.testing.assert_allclose(slopes[0], (np.arange(2, 7) - 3.5) / 8 / 3.3)
    np.testing.assert_allclose(slopes[1], (np.arange(3, 6) - 3.5) / 8 / 3.3)


def test_hexagonal_arrays_keep_the_lenses_own_places_if_asked_and_mark_what_is_missing(tmp_path: Path) -> None:
    outputs = [{"kind": "npz", "pixels": "lenses"}, {"kind": "npz", "name": "square", "dtype": "uint16"}]
    job = coded_job(tmp_path, outputs, HEXAGONAL)
    job.make("npz.npz")
    job.make("square.npz")
    with job.file("exports/npz/0001.npz") as path, np.load(path) as read:
        views, exists, right, down = (read[name] for name in ("views", "exists", "right_pitches", "down_pitches"))
    told = linear_of(view_codes(job.layout, of_lens=False) / 1023).astype(np.float16)
    np.testing.assert_array_equal(exists, job.layout.mask)
    np.testing.assert_array_equal(views[exists], told[exists])
    assert np.isnan(views[~exists]).all()
    # Each lens has six neighbours one pitch off, in the middle of the array.
    distance = np.hypot(right - right[3, 3], down - down[3, 3])
    assert np.isclose(distance, 1.0).sum() == 6
    with job.file("exports/square/0001.npz") as path, np.load(path) as read:
        assert read["views"].shape[2:4] == job.layout.square_size() == read["right_pitches"].shape
        assert not read["views"][~read["exists"]].any()
        np.testing.assert_allclose(read["down_pitches"][:, 0], np.arange(6) - 2.5)


def frames_of(path: Path, cols: int, rows: int) -> list[tuple[NDArray[np.uint8], ...]]:
    """Return the planes of raw frames, as FFmpeg cuts them."""
    options = {"video_size": f"{cols}x{rows}", "pixel_format": "yuv420p", "framerate": "30"}
    with av.open(str(path), format="rawvideo", options=options) as container:
        found: list[tuple[NDArray[np.uint8], ...]] = []
        for frame in container.decode(video=0):
            whole = frame.to_ndarray().astype(np.uint8, casting="no")
            y, chroma = whole[:rows], whole[rows:].reshape(2, rows // 2, cols // 2)
            found.append((y, chroma[0], chroma[1]))
        return found


@pytest.mark.parametrize("rig", [SQUARE, HEXAGONAL], ids=["square", "hexagonal"])
@pytest.mark.parametrize("convention", ["orthoscopic", "pseudoscopic"])
def test_a_lenslet_sequence_has_the_sheets_frame_after_frame(
    tmp_path: Path, rig: dict[str, Any], convention: str
) -> None:
    job = coded_job(
        tmp_path, [{"kind": "mpeg_lenslet", "convention": convention}], rig, title="Fish: take 2 (n°1)", fps=30
    )
    job.make("mpeg_lenslet")
    layout = job.layout
    rows, cols = layout.rows + layout.rows % 2, layout.cols + layout.cols % 2
    stem = f"FishTake2N1_{cols}x{rows}_30fps_8bit"
    assert files_of(job, "mpeg_lenslet") == {f"{stem}.yuv", f"{stem}.xml"}
    with job.file(f"exports/mpeg_lenslet/{stem}.yuv") as path:
        assert path.stat().st_size == 2 * rows * cols * 3 // 2
        frames = frames_of(path, cols, rows)
    assert len(frames) == 2
    for frame, (y, cb, _) in enumerate(frames, start=1):
        sheet = coded_sheet(layout, view_codes(layout, of_lens=rig is SQUARE, frame=frame))
        told = sheet if convention == "orthoscopic" else captured(sheet, rig)
        encoded = encoded_srgb(told)
        padded = np.pad(encoded, ((0, layout.rows % 2), (0, layout.cols % 2), (0, 0)), mode="edge")
        exact = bt709(np.rint(padded * 255) / 255)
        np.testing.assert_allclose(y, exact[..., 0], atol=1.4)
        np.testing.assert_allclose(cb, exact[..., 1].reshape(rows // 2, 2, cols // 2, 2).mean((1, 3)), atol=1.4)
    assert job.sidecar("mpeg_lenslet")["format"]["convention"] == convention


def captured(ortho: NDArray[np.float64], rig: dict[str, Any]) -> NDArray[np.float64]:
    """Return the sheet that the pipeline made this orthoscopic one of, found as the one that it gives for it."""
    parsed = Rig.model_validate(rig)
    before = CellLayout(*parsed.lens_array.count, parsed.px_per_lens, parsed.lens_array.lattice)
    numbers = np.arange(before.px, dtype=np.float64).reshape(before.rows, before.cols, 1)
    source = orthoscopic(numbers + 1, before)[..., 0].astype(int) - 1
    sheet = np.zeros_like(ortho)
    there = source >= 0
    sheet.reshape(-1, 3)[source[there]] = ortho[there]
    return sheet


def test_a_stopped_folder_goes_on_where_it_was(tmp_path: Path) -> None:
    class Ends:
        """A monitor that stops the work after a number of reports."""

        def __init__(self, reports: int) -> None:
            self.told: list[float] = []
            self.reports = reports

        @property
        def progress(self) -> float:
            return self.told[-1]

        @progress.setter
        def progress(self, fraction: float) -> None:
            self.told.append(fraction)

        def should_stop(self) -> bool:
            return len(self.told) >= self.reports

        def announce_end(self) -> None: ...

    job = coded_job(tmp_path, ["hci", "mpeg_lenslet"])
    for output, reports in (("hci", 32), ("mpeg_lenslet", 2)):
        with pytest.raises(Stopped):
            job.make(output, Ends(reports))
    assert len(files_of(job, "hci")) == 30
    assert {Path(name).suffix for name in files_of(job, "mpeg_lenslet")} == {".xml"}
    before = job.place.store.etag(f"{JOB_ID}/exports/hci/0001/input_Cam000.png")
    job.make("hci")
    assert job.place.store.etag(f"{JOB_ID}/exports/hci/0001/input_Cam000.png") == before
    assert len(files_of(job, "hci")) == 100
    assert len(job.sidecar("hci")["files"]) == 100


def test_a_sidecar_says_conventions_rows_and_display(tmp_path: Path) -> None:
    job = coded_job(tmp_path, ["hci"], HEXAGONAL, display={"gap_real_mm": 4.8})
    job.make("hci")
    said = job.sidecar("hci")
    image = said["integral_image"]
    # Seven rows, turned with the sheet: the even ones are shifted now.
    assert image["shifted_rows"] == "even"
    assert image["size_px"] == [job.layout.rows, job.layout.cols]
    assert said["display"]["gap_real_mm"] == 4.8
    assert "positive in front" in image["depth"]
    assert said["format"]["missing_views"] == []
    with job.file("exports/hci/0001/input_Cam000.png") as path:
        read = read_png(path)
    codes = view_codes(job.layout, of_lens=False)[3, 2, 0, 0]
    assert read.shape[:2] == job.layout.square_size()
    assert np.abs(read - codes / 1023 * 255).max() <= 0.51


@pytest.mark.parametrize("n", [2, 4, 6, 8, 10, 16, 24])
def test_which_views_exist_is_what_the_hexagons_mask_says(n: int) -> None:
    rig = Rig.model_validate({"lens_array": {"lattice": "hexagonal", "count": [3, 3]}, "px_per_lens": n})
    layout, box = display_size(rig), all_views(rig)
    mask = layout.mask
    assert (box.rows, box.cols) == mask.shape
    for rows in range(1, box.rows + 1):
        for cols in range(1, box.cols + 1):
            block = block_about_the_middle(rig, (rows, cols))
            assert all_views_exist(rig, block) == all(mask[v, u] for u, v in block.numbers)
            assert block.numbers[block.middle] == (n // 2, box.rows // 2)
    assert all_views_exist(rig, largest_odd_square(rig))


def test_views_put_on_square_pixels_together_are_those_put_there_alone() -> None:
    layout = CellLayout(5, 4, 4, "hexagonal")
    sheet = np.random.default_rng(5).random((layout.rows, layout.cols, 3), dtype=np.float32)
    views = light_field(image_of(sheet, layout))
    together = on_square_pixels(views, layout)
    for v, u in np.ndindex(*views.shape[:2]):
        np.testing.assert_array_equal(together[v, u], as_square(views[v, u], layout))
