"""Quilts, epipolar slices, contact sheets and sheets of a job, opened by other readers than ours."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from lippmann.errors import SpecError
from lippmann.job.outputs.output import OutputOptions
from lippmann.job.spec import parse_spec
from lippmann.lattice.cell import Lattice
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.sheet.cells import cells
from lippmann.lightfield.views.square_pixels import as_square
from lippmann.lightfield.views.views import centre, grid_size, interlace, view, view_numbers
from lippmann.plan import artifact_names as names
from lippmann.plan.sampling import frame_size
from tests.builders_outputs import GivenJob, given_job
from tests.pictures import read_tiff, tags_of_tiff
from worker.images.colour import srgb_codes
from worker.images.read import read_rgb


def opened(job: GivenJob, name: str) -> NDArray[Any]:
    with job.file(name) as path, Image.open(path) as picture:
        return np.asarray(picture)


def place_coded(layout: CellLayout) -> NDArray[np.float32]:
    """Return an orthoscopic sheet whose view (u, v) is flat: red (u + 1) / 16, green (v + 1) / 16."""
    grid = np.zeros((*grid_size(layout), 3), np.float32)
    for u, v in view_numbers(layout):
        at = np.s_[v * layout.lens_rows : (v + 1) * layout.lens_rows, u * layout.lens_cols : (u + 1) * layout.lens_cols]
        grid[at] = np.array([(u + 1) / 16, (v + 1) / 16, 0.5])
    return interlace(grid, layout)


def coded(u: float, v: float) -> NDArray[np.uint8]:
    light = np.array([[[(u + 1) / 16, (v + 1) / 16, 0.5]]], np.float32)
    codes: NDArray[np.uint8] = srgb_codes(light)[0, 0]
    return codes


def tiles_of(quilt: NDArray[Any], columns: int, rows: int) -> list[NDArray[Any]]:
    """Return a quilt's tiles as Looking Glass numbers them: from the lower left, to the right, then up."""
    high, wide = quilt.shape[0] // rows, quilt.shape[1] // columns
    assert quilt.shape == (high * rows, wide * columns, 3)
    return [
        quilt[row * high : (row + 1) * high, col * wide : (col + 1) * wide]
        for row in range(rows - 1, -1, -1)
        for col in range(columns)
    ]


@pytest.mark.parametrize("lattice", ["square", "hexagonal"])
def test_a_quilt_begins_with_the_leftmost_view_at_the_lower_left(tmp_path: Path, lattice: Lattice) -> None:
    layout = CellLayout(6, 5, 4, lattice)
    job = given_job(tmp_path, {1: place_coded(layout)}, outputs=["quilt.png"], lens_array={"lattice": lattice})
    job.make("quilt.png")
    (name,) = job.sidecar("quilt.png")["files"]
    high, wide = layout.square_size()
    assert name == f"exports/quilt/0001_qs2x2a{wide / high:.4g}.png"
    for u, tile in enumerate(tiles_of(opened(job, name), 2, 2)):
        np.testing.assert_array_equal(tile, np.broadcast_to(coded(u, centre(layout)[1]), tile.shape))


def test_a_quilt_of_another_count_is_interpolated_cut_and_scaled(tmp_path: Path) -> None:
    asked = {"kind": "quilt", "count": 7, "view_row": 0, "aspect": 0.5, "scale": 3, "filter": "box", "columns": 7}
    job = given_job(tmp_path, {1: place_coded(CellLayout(6, 5, 4))}, outputs=[asked])
    job.make("quilt.png")
    quilt = opened(job, "exports/quilt/0001_qs7x1a0.5.png")
    assert quilt.shape == (6 * 3, 7 * 3 * 3, 3)
    for number, tile in enumerate(tiles_of(quilt, 7, 1)):
        assert np.abs(tile.astype(int) - coded(number / 2, 0)).max() <= 1


def test_a_row_of_hexagonal_views_that_does_not_divide_is_refused_when_the_job_comes(tmp_path: Path) -> None:
    asked = {"kind": "quilt", "view_row": 1, "columns": 8}
    with pytest.raises(SpecError, match=r"outputs\.0\.columns: expected a number that divides the 2 views, got 8"):
        given_job(tmp_path, outputs=[asked], px_per_lens=8, lens_array={"lattice": "hexagonal"})


def test_a_quilt_of_all_views_has_the_lowest_row_of_views_below(tmp_path: Path) -> None:
    job = given_job(tmp_path, {1: place_coded(CellLayout(6, 5, 4))}, outputs=[{"kind": "quilt", "views": "all"}])
    job.make("quilt.png")
    tiles = tiles_of(opened(job, "exports/quilt/0001_qs4x4a0.8333.png"), 4, 4)
    for number, tile in enumerate(tiles):
        v, u = divmod(number, 4)
        assert (tile == coded(u, 3 - v)).all()


def test_slices_stand_below_each_other_and_side_by_side(tmp_path: Path) -> None:
    asked = {"kind": "epi", "lens_rows": [0, 5], "lens_cols": [1, 2, 3], "view_px": 2, "gap_px": 1}
    job = given_job(tmp_path, {1: place_coded(CellLayout(6, 5, 4))}, outputs=[asked])
    job.make("epi.png")
    rows, cols = opened(job, "exports/epi/0001-rows.png"), opened(job, "exports/epi/0001-cols.png")
    assert rows.shape == (1 + 2 * (4 * 2 + 1), 5 + 2, 3)
    assert cols.shape == (6 + 2, 1 + 3 * (4 * 2 + 1), 3)
    for u in range(4):
        assert (rows[[1 + 2 * u, 2 + 2 * u, 10 + 2 * u], 1:-1] == coded(u, 2)).all()
        assert (cols[1:-1, [1 + 2 * u, 11 + 2 * u]] == coded(2, u)).all()
    assert not rows[9].any()


def test_a_slice_is_of_the_middle_lens_row_when_none_is_named(tmp_path: Path) -> None:
    job = given_job(tmp_path, outputs=[{"kind": "epi", "gap_px": 0}])
    job.make("epi.png")
    with job.file(names.orthoscopic_name(1)) as master:
        ortho = read_rgb(master, np.float32)
    expected = srgb_codes(np.stack([view(ortho, job.layout, u, 2)[3] for u in range(4)]))
    np.testing.assert_array_equal(opened(job, "exports/epi/0001-rows.png"), expected)
    assert job.sidecar("epi.png")["files"] == ["exports/epi/0001-rows.png"]


@pytest.mark.parametrize("lattice", ["square", "hexagonal"])
def test_a_contact_sheet_shows_the_centre_views_of_the_frames_asked_for(tmp_path: Path, lattice: str) -> None:
    asked = {"kind": "contact_sheet", "frames": "2-6", "every": 2, "gap_px": 3, "captions": False}
    job = given_job(tmp_path, frames="1-6", outputs=[asked], lens_array={"lattice": lattice})
    job.make("contact_sheet.png")
    sheet = opened(job, "exports/contact_sheet/contact_sheet.png")
    high, wide = job.layout.square_size()
    assert sheet.shape == (2 * high + 9, 2 * wide + 9, 3)
    for number, frame in enumerate((2, 4, 6)):
        with job.file(names.orthoscopic_name(frame)) as master:
            ortho = read_rgb(master, np.float16)
        expected = srgb_codes(as_square(view(ortho, job.layout, *centre(job.layout)), job.layout))
        top, left = (3 + number // 2 * (high + 3)), (3 + number % 2 * (wide + 3))
        np.testing.assert_array_equal(sheet[top : top + high, left : left + wide], expected)


def test_captions_are_letters_below_the_pictures(tmp_path: Path) -> None:
    layout = CellLayout(20, 70, 4)
    asked = {"kind": "contact_sheet", "gap_px": 0, "columns": 1}
    flat = {frame: np.zeros((layout.rows, layout.cols, 3), np.float32) for frame in (1, 2)}
    job = given_job(tmp_path, flat, frames="1-2", outputs=[asked], count=(20, 70))
    job.make("contact_sheet.png")
    sheet = opened(job, "exports/contact_sheet/contact_sheet.png")
    assert sheet.shape == (2 * 36, 70, 3)
    first, second = sheet[20:36], sheet[56:72]
    assert not sheet[:20].any()
    assert (first[0] == first[0, 0]).all()
    assert first.max() > 200
    assert (first[:, :35] == second[:, :35]).all()  # "frame "
    assert (first != second).any()  # "1" and "2"


def test_a_contact_sheet_of_views_leaves_out_those_that_are_not_there(tmp_path: Path) -> None:
    layout = CellLayout(6, 5, 4, "hexagonal")
    asked = {"kind": "contact_sheet", "show": "views", "gap_px": 0, "captions": False, "scale": 2, "filter": "box"}
    given = {1: place_coded(layout)}
    job = given_job(tmp_path, given, outputs=[asked], lens_array={"lattice": "hexagonal"})
    job.make("contact_sheet.png")
    sheet = opened(job, "exports/contact_sheet/contact_sheet.png")
    high, wide = (2 * side for side in layout.square_size())
    assert sheet.shape == (high * layout.cell_rows, wide * layout.cell_cols, 3)
    for v in range(layout.cell_rows):
        for u in range(layout.cell_cols):
            tile = sheet[v * high : (v + 1) * high, u * wide : (u + 1) * wide]
            assert (tile == (coded(u, v) if layout.mask[v, u] else srgb_codes(np.full((1, 1, 3), 0.03)))).all()


@pytest.mark.parametrize("of", ["orthoscopic", "integral", "views", "device"])
@pytest.mark.parametrize("lattice", ["square", "hexagonal"])
def test_sheets_are_the_masters_of_the_job_at_their_size_on_paper(tmp_path: Path, of: str, lattice: str) -> None:
    asked = {"kind": "sheets", "of": of, "file_format": "tiff", "bits": 16}
    job = given_job(tmp_path, outputs=[asked], lens_array={"lattice": lattice}, rig={"device": {"dpi": 90}})
    job.make("sheets.tif")
    with job.file("exports/sheets/0001.tif") as path:
        codes, tags = read_tiff(path), tags_of_tiff(path)
    with job.file(names.orthoscopic_name(1)) as master:
        ortho = srgb_codes(read_rgb(master, np.float32), bits=16)
    if of == "views":
        assert (tags["XResolution"], tags["YResolution"], tags["ResolutionUnit"]) == (1, 1, 1)  # square, of no size
    else:
        across, down = (float(tags[name]) for name in ("XResolution", "YResolution"))
        per_pitch = (90 / 25.4,) * 2 if of == "device" else (4, job.layout.row_px)
        row_pitch = 1 if lattice == "square" or of == "device" else np.sqrt(3) / 2
        assert (across, down) == pytest.approx((per_pitch[0] * 25.4, per_pitch[1] * 25.4 / row_pitch))
    if of == "orthoscopic":
        np.testing.assert_array_equal(codes, ortho)
    elif of == "integral" and lattice == "square":
        # The imaging lens inverts: lenses in reverse order, cells as they were.
        of_lenses = ortho.reshape(6, 4, 5, 4, 3)
        np.testing.assert_array_equal(codes, of_lenses[::-1, :, ::-1].reshape(ortho.shape))
    elif of == "integral":
        captured = cells(codes, frame_size(job.sheet.spec.rig))
        np.testing.assert_array_equal(captured[::-1, ::-1], cells(ortho, job.layout))
    elif of == "views":
        with job.file(names.views_name(1)) as master:
            np.testing.assert_array_equal(codes, srgb_codes(read_rgb(master, np.float32), bits=16))
    else:
        assert codes.shape[1] == round((5 if lattice == "square" else 5.5) * 90 / 25.4)


@pytest.mark.parametrize(
    ("output", "rig", "field", "expected", "got"),
    [
        ({"kind": "quilt", "view_row": 8}, {}, "view_row", "from 0 to 7", "8"),
        ({"kind": "quilt", "columns": 3}, {}, "columns", "divides the 8 views", "3"),
        ({"kind": "quilt", "columns": 7, "count": 48}, {}, "columns", "divides the 48 views", "7"),
        ({"kind": "quilt", "views": "all", "count": 9}, {}, "count", "the grid of views", "9"),
        ({"kind": "quilt", "views": "all"}, {"lens_array": {"lattice": "hexagonal"}}, "views", "row", "'all'"),
        ({"kind": "quilt", "aspect": 0}, {}, "aspect", "a number of at least 0.01", "0"),
        ({"kind": "quilt", "count": 4096, "scale": 10}, {}, "scale", "at most 32768 px a side", "57600 px"),
        ({"kind": "quilt", "filter": "sinc"}, {}, "filter", "lanczos3", "'sinc'"),
        ({"kind": "epi", "lens_rows": [3, 90]}, {}, "lens_rows.1", "from 0 to 89", "90"),
        ({"kind": "epi", "lens_cols": [40]}, {"lens_array": {"count": [90, 40]}}, "lens_cols.0", "from 0 to 39", "40"),
        ({"kind": "contact_sheet", "frames": "2-4"}, {}, "frames", "frames of the job", "4"),
        ({"kind": "contact_sheet", "frames": "4-2"}, {}, "frames", "a range that counts up", "'4-2'"),
        ({"kind": "contact_sheet", "show": "views", "scale": 64}, {}, "scale", "at most 32768 px a side", " px"),
        ({"kind": "sheets", "of": "device"}, {}, "of", "without rig.device", "'device'"),
    ],
)
def test_what_cannot_be_is_said_by_field_when_the_job_arrives(
    output: dict[str, Any], rig: dict[str, Any], field: str, expected: str, got: str
) -> None:
    with pytest.raises(SpecError) as refused:
        parse_spec({"scene": "fish", "frames": "1-3", "rig": rig, "outputs": ["centre.mp4", output]})
    (problem,) = refused.value.problems
    assert problem.field == f"outputs.1.{field}"
    assert expected in problem.expected
    assert got in problem.got


def test_every_kind_stands_for_its_files_by_their_suffix(tmp_path: Path) -> None:
    short = ["quilt.png", "epi.png", "contact_sheet.png", "sheets.png", "sheets.tif"]
    outputs: tuple[OutputOptions, ...] = parse_spec({"scene": "fish", "outputs": short}).outputs
    assert [output.file_name for output in outputs] == short
