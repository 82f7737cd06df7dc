"""Prints, read as a print shop reads them: sizes, densities, places of marks, and every pixel of the array."""

from __future__ import annotations

import re
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pypdf
import pytest
from numpy.typing import NDArray
from PIL import Image

from lippmann.errors import SpecError
from lippmann.job.outputs.prints import Print
from lippmann.job.spec import parse_spec
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.sheet.device import to_device
from lippmann.plan import artifact_names as names
from lippmann.plan.design import designer
from lippmann.plan.printing.page import PrintPage, middle_edges, print_page
from lippmann.plan.printing.shapes import Bar, Ring
from tests.builders_outputs import GivenJob, given_job
from tests.pictures import read_tiff, tags_of_tiff
from tests.srgb import linear_of
from worker.images.colour import srgb_codes
from worker.images.icc import srgb_profile
from worker.images.read import read_rgb

DPI = 254.0 * 1.016
"""10.16 px a lens of 1 mm: cells of 10 and 11 px."""
PIXEL_MM = 25.4 / DPI
MARGIN_PX = 122
"""12 mm are 121.92 px."""
POINT_MM = 25.4 / 72


def made(folder: Path, file: str, **options: Any) -> GivenJob:
    """Return a job of 6 x 5 lenses whose print was made."""
    more = {name: options.pop(name) for name in ("lens_array", "count", "rig") if name in options}
    job = given_job(folder, outputs=[{"kind": "print", "dpi": DPI, **options}], **more)
    job.make(file)
    return job


def array_of(job: GivenJob, bits: int, pitch_mm: float = 1.0) -> NDArray[Any]:
    """Return the codes of the array on the device."""
    with job.file(names.orthoscopic_name(1)) as path:
        ortho = read_rgb(path, np.float16)
    return srgb_codes(to_device(ortho, job.layout, px_per_lens_device=pitch_mm / PIXEL_MM), bits=bits)


def tiff_of(job: GivenJob) -> tuple[NDArray[Any], dict[str, Any]]:
    with job.file("exports/print/0001.tif") as path:
        return read_tiff(path), tags_of_tiff(path)


@pytest.mark.parametrize(("lenses", "px"), [(90, 2126), (100, 2362)])
def test_lenses_of_1_mm_at_600_dpi_are_as_many_pixels_as_come_nearest(lenses: int, px: int) -> None:
    page = page_of(CellLayout(lenses, lenses, 24), pixel_mm=25.4 / 600)
    assert (page.array_rows, page.array_cols) == (px, px)
    assert px == round(lenses * 600 / 25.4)
    assert page.rows == px + 2 * page.top_px
    # Where the lenses end is told from the middle, and differs from where the pixels end.
    left = next(shape for shape in page.shapes if isinstance(shape, Bar) and shape.height_mm > shape.width_mm)
    middle_mm = page.cols * page.pixel_mm / 2
    assert middle_mm - (left.left_mm + left.width_mm / 2) == pytest.approx(lenses / 2, abs=1e-9)


@pytest.mark.parametrize("bits", [8, 16])
@pytest.mark.parametrize("lattice", ["square", "hexagonal"])
def test_the_array_of_a_tiff_is_the_sheet_on_the_devices_pixels(tmp_path: Path, bits: int, lattice: str) -> None:
    job = made(tmp_path, "print.tif", file_format="tiff", bits=bits, lens_array={"lattice": lattice})
    codes, tags = tiff_of(job)
    expected = array_of(job, bits)
    if lattice == "square":
        assert expected.shape[:2] == (61, 51)
    rows, cols = expected.shape[:2]
    assert codes.shape == (rows + 2 * MARGIN_PX, cols + 2 * MARGIN_PX, 3)
    np.testing.assert_array_equal(codes[MARGIN_PX:-MARGIN_PX, MARGIN_PX:-MARGIN_PX], expected)
    white = 2**bits - 1
    assert (codes[0] == white).all()
    # Paper begins with the very next pixel, but for the marks further out.
    around = codes[MARGIN_PX - 1 : rows + MARGIN_PX + 1, MARGIN_PX - 1 : cols + MARGIN_PX + 1]
    assert (around[[0, -1]] == white).all()
    assert (around[:, [0, -1]] == white).all()
    assert float(tags["XResolution"]) == pytest.approx(DPI, rel=1e-9)
    assert tags["ResolutionUnit"] == 2
    assert tags["YResolution"] == tags["XResolution"]
    assert tags["ICCProfile"] == srgb_profile()


def test_marks_stand_where_the_lenses_end_to_a_part_of_a_pixel(tmp_path: Path) -> None:
    codes, _ = tiff_of(made(tmp_path, "print.tif", file_format="tiff", label=False, registration_marks=False))
    code = codes[:, :, 0] / 255
    ink = 1 - linear_of(code)
    middle = np.array(codes.shape[:2]) / 2
    near, far = round(3.0 / PIXEL_MM), round(6.5 / PIXEL_MM)
    for axis, lenses in ((0, 6), (1, 5)):
        # Through the crop marks beyond one side of the array, across them.
        beside = ink if axis == 0 else ink.T
        edge = int(middle[1 - axis] - (5 if axis == 0 else 6) / 2 / PIXEL_MM)
        profile = beside[:, edge - far : edge - near].mean(axis=1)
        marks = np.split(np.arange(len(profile)), np.flatnonzero(np.diff(profile > 0.02)) + 1)
        centres = [
            (profile[part] * (part + 0.5)).sum() / profile[part].sum() for part in marks if profile[part[0]] > 0.02
        ]
        ends = (centres[0] - middle[axis], centres[-1] - middle[axis])
        assert ends == pytest.approx((-lenses / 2 / PIXEL_MM, lenses / 2 / PIXEL_MM), abs=0.02)


@pytest.mark.parametrize("file_format", ["png", "tiff", "pdf"])
def test_a_flat_grey_is_its_code_on_paper(tmp_path: Path, file_format: str) -> None:
    sheet = np.full((24, 20, 3), 0.5, np.float32)
    asked = {"kind": "print", "dpi": DPI, "file_format": file_format}
    job = given_job(tmp_path, {1: sheet}, outputs=[asked])
    file = {"png": "print.png", "tiff": "print.tif", "pdf": "print.pdf"}[file_format]
    job.make(file)
    with job.file(f"exports/print/0001{Path(file).suffix}") as path:
        if file_format == "pdf":
            picture = pypdf.PdfReader(path).pages[0].images[0].image
            assert picture is not None
            codes = np.asarray(picture)
        else:
            with Image.open(path) as opened:
                codes = np.asarray(opened)[MARGIN_PX:-MARGIN_PX, MARGIN_PX:-MARGIN_PX]
    assert codes.shape == (61, 51, 3)
    assert (codes == 188).all()


def test_a_png_says_whole_pixels_a_metre(tmp_path: Path) -> None:
    job = made(tmp_path, "print.png", file_format="png")
    with job.file("exports/print/0001.png") as path, Image.open(path) as picture:
        assert picture.info["dpi"] == pytest.approx((10160 * 0.0254,) * 2)
        np.testing.assert_array_equal(np.asarray(picture)[MARGIN_PX:-MARGIN_PX, MARGIN_PX:-MARGIN_PX], array_of(job, 8))


@pytest.mark.parametrize("bits", [8, 16])
def test_a_pdf_places_each_pixel_on_one_of_the_devices(tmp_path: Path, bits: int) -> None:
    job = made(tmp_path, "print.pdf", bits=bits)
    with job.file("exports/print/0001.pdf") as path:
        reader = pypdf.PdfReader(path, strict=True)
        page = reader.pages[0]
        width, height = (float(side) * POINT_MM for side in page.mediabox.upper_right)
        assert (width, height) == pytest.approx(((51 + 244) * PIXEL_MM, (61 + 244) * PIXEL_MM), abs=1e-4)
        contents = page.get_contents()
        assert contents is not None
        drawn = contents.get_data().decode("latin-1")
        (picture,) = (item.get_object() for item in page["/Resources"]["/XObject"].values())  # type: ignore[index]  # a dictionary
        profile = picture["/ColorSpace"][1].get_object().get_data()
        codes = np.frombuffer(picture.get_data(), ">u2" if bits == 16 else "u1").reshape(61, 51, 3)
        assert reader.trailer["/Root"]["/ViewerPreferences"]["/PrintScaling"] == "/None"  # type: ignore[index]  # a dictionary
        text = page.extract_text()
        fonts = [font.get_object() for font in page["/Resources"]["/Font"].get_object().values()]  # type: ignore[index]  # a dictionary
    matrix = re.search(r"([\d. ]+) cm\s+/FormXob", drawn)
    assert matrix is not None
    wide, _, _, high, left, bottom = (float(number) * POINT_MM for number in matrix[1].split())
    assert (wide / 51, high / 61) == pytest.approx((PIXEL_MM, PIXEL_MM), rel=1e-5)
    assert (left, bottom) == pytest.approx((MARGIN_PX * PIXEL_MM, MARGIN_PX * PIXEL_MM), abs=1e-4)
    assert (picture["/Width"], picture["/Height"], picture["/BitsPerComponent"]) == (51, 61, bits)
    assert not picture["/Interpolate"].value
    assert profile == srgb_profile()
    np.testing.assert_array_equal(codes, array_of(job, bits))
    assert len(fonts) == 1
    assert "/FontFile2" in fonts[0]["/FontDescriptor"].get_object()  # embedded
    assert "frame 1" in text
    assert "lens pitch 1 mm" in text
    assert f"gap {job.sidecar('print.pdf')['format']['gap_mm']:.2f} mm" in text
    assert "print at 100 %" in text


def test_the_marks_of_a_pdf_stand_where_the_lenses_end(tmp_path: Path) -> None:
    job = made(tmp_path, "print.pdf", lens_pitch_mm=1.004)
    with job.file("exports/print/0001.pdf") as path:
        page = pypdf.PdfReader(path).pages[0]
        contents = page.get_contents()
        assert contents is not None
        drawn = contents.get_data().decode("latin-1")
        width, height = (float(side) * POINT_MM for side in page.mediabox.upper_right)
    bars = [[float(number) * POINT_MM for number in bar.split()] for bar in re.findall(r"([\d. -]+) re", drawn)]
    upright = sorted({round(x + wide / 2 - width / 2, 3) for x, _, wide, high in bars if high > wide})
    level = sorted({round(y + high / 2 - height / 2, 3) for _, y, wide, high in bars if wide > high})
    # Crop marks at both ends, crosses in the middle of the other sides beyond them, and the lens edge between.
    assert [x for x in upright if abs(x) <= 2.6] == pytest.approx([-2.5 * 1.004, 0.5 * 1.004, 2.5 * 1.004], abs=1e-3)
    assert [y for y in level if abs(y) <= 3.1] == pytest.approx([-3 * 1.004, 0.0, 3 * 1.004], abs=1e-3)


def test_a_page_without_marks_and_margin_is_the_array(tmp_path: Path) -> None:
    bare = {"margin_mm": 0, "crop_marks": False, "registration_marks": False, "label": False}
    job = made(tmp_path, "print.tif", file_format="tiff", **bare)
    np.testing.assert_array_equal(tiff_of(job)[0], array_of(job, 8))
    about = job.sidecar("print.tif")["format"]
    assert (about["page_px"], about["array_px"]) == ([61, 51], [61, 51])
    assert (about["array_top_px"], about["array_left_px"]) == (0, 0)


@pytest.mark.parametrize(("mirrored", "orientation_deg"), [(True, 0), (False, 90), (True, 180), (True, 270)])
def test_a_print_is_mirrored_and_then_turned_clockwise(tmp_path: Path, mirrored: bool, orientation_deg: int) -> None:
    asked = {"file_format": "tiff", "mirrored": mirrored, "orientation_deg": orientation_deg}
    job = made(tmp_path, "print.tif", **asked)
    codes, _ = tiff_of(job)
    expected = array_of(job, 8)
    if mirrored:
        expected = np.fliplr(expected)
    for _ in range(orientation_deg // 90):
        expected = expected.transpose(1, 0, 2)[:, ::-1]  # what was the lower left corner is the upper left one
    np.testing.assert_array_equal(codes[MARGIN_PX:-MARGIN_PX, MARGIN_PX:-MARGIN_PX], expected)


def test_an_array_of_another_pitch_is_printed_as_it_was_measured(tmp_path: Path) -> None:
    job = made(tmp_path, "print.tif", file_format="tiff", lens_pitch_mm=1.1)
    codes, _ = tiff_of(job)
    expected = array_of(job, 8, pitch_mm=1.1)
    assert expected.shape == (67, 56, 3)
    np.testing.assert_array_equal(codes[MARGIN_PX:-MARGIN_PX, MARGIN_PX:-MARGIN_PX], expected)


def test_the_rigs_device_is_taken_where_the_print_names_none(tmp_path: Path) -> None:
    rig = {"device": {"pitch_um": PIXEL_MM * 1000, "margin_px": 50}}
    job = given_job(tmp_path, outputs=["print.png"], rig=rig)
    job.make("print.png")
    with job.file("exports/print/0001.png") as path, Image.open(path) as picture:
        assert picture.size == (51 + 2 * MARGIN_PX, 61 + 2 * MARGIN_PX)


def page_of(layout: CellLayout, *, pixel_mm: float = 0.05, pitch_mm: float = 1.0, **options: Any) -> PrintPage:
    return print_page(layout, Print(**options), lens_pitch_mm=pitch_mm, pixel_mm=pixel_mm, label="x")


@pytest.mark.parametrize("lattice", ["square", "hexagonal"])
@pytest.mark.parametrize(("lens_rows", "lens_cols"), [(4, 6), (5, 6), (4, 7), (5, 7), (1, 1)])
def test_crosses_stand_at_the_lens_edges_nearest_to_the_middle(lattice: Any, lens_rows: int, lens_cols: int) -> None:
    layout = CellLayout(lens_rows, lens_cols, 4, lattice)
    right, down = middle_edges(layout)
    # Where the sheet's own cells meet, in pitches from the middle of the array.
    wide = layout.cols / layout.px_per_lens
    edges = np.arange(lens_cols + 1) - wide / 2
    assert np.abs(edges - right).min() < 1e-12
    assert abs(right) <= np.abs(edges).min() + 1e-9
    if lattice == "square":
        assert down == (lens_rows % 2) / 2
    else:
        row_pitch = np.sqrt(3) / 2
        centres = (np.arange(lens_rows) - (lens_rows - 1) / 2) * row_pitch
        between = [
            (above + below) / 2
            for above, below in pairwise([centres[0] - row_pitch, *centres, centres[-1] + row_pitch])
        ]
        assert np.abs(np.array(between) - down).min() < 1e-12


@pytest.mark.parametrize("orientation_deg", [0, 90, 180, 270])
@pytest.mark.parametrize("mirrored", [False, True])
def test_crosses_turn_with_the_array(orientation_deg: int, mirrored: bool) -> None:
    layout = CellLayout(5, 7, 4)  # the edges nearest to the middle are half a lens to the right and below
    page = page_of(layout, orientation_deg=orientation_deg, mirrored=mirrored)
    middle = np.array([page.cols, page.rows]) * page.pixel_mm / 2
    rings = {tuple(np.round((ring.x_mm, ring.y_mm) - middle, 6)) for ring in page.shapes if isinstance(ring, Ring)}
    away = 4.75
    expected = [(0.5, s * (2.5 + away)) for s in (-1, 1)] + [(s * (3.5 + away), 0.5) for s in (-1, 1)]
    if mirrored:
        expected = [(-x, y) for x, y in expected]
    for _ in range(orientation_deg // 90):
        expected = [(-y, x) for x, y in expected]
    assert rings == {(round(x, 6), round(y, 6)) for x, y in expected}


def test_marks_and_label_keep_off_the_array_and_on_the_page() -> None:
    page = page_of(CellLayout(5, 7, 4), margin_mm=11.5)
    margin_mm = page.left_px * page.pixel_mm
    for shape in page.shapes:
        if not isinstance(shape, Bar):
            continue
        assert shape.left_mm >= 0
        assert shape.top_mm >= 0
        assert shape.right_mm <= page.cols * page.pixel_mm
        assert shape.bottom_mm <= page.rows * page.pixel_mm
        outside = (
            shape.right_mm <= margin_mm
            or shape.left_mm >= margin_mm + page.array_cols * page.pixel_mm
            or shape.bottom_mm <= margin_mm
            or shape.top_mm >= margin_mm + page.array_rows * page.pixel_mm
        )
        assert outside


@pytest.mark.parametrize(
    ("paper", "count", "orientation_deg", "page_mm"),
    [
        ("a4", (90, 90), 0, (210.0, 297.0)),
        ("letter", (90, 90), 0, (215.9, 279.4)),
        ("a4", (100, 200), 0, (297.0, 210.0)),
        ("a4", (100, 200), 90, (210.0, 297.0)),
        ("letter", (255, 101), 0, (215.9, 279.4)),
    ],
)
def test_on_a_sheet_of_paper_the_array_is_in_the_middle_on_whole_pixels(
    paper: str, count: tuple[int, int], orientation_deg: int, page_mm: tuple[float, float]
) -> None:
    pixel_mm = 25.4 / 600
    page = page_of(CellLayout(*count, 8), pixel_mm=pixel_mm, page=paper, orientation_deg=orientation_deg)
    assert (page.width_mm, page.height_mm) == page_mm
    assert (page.cols, page.rows) == tuple(round(side / pixel_mm) for side in page_mm)
    wide, high = count if orientation_deg else count[::-1]
    assert (page.lenses.width_mm, page.lenses.height_mm) == (wide, high)
    aside = page_mm[0] - 2 * page.lenses.left_mm - wide, page_mm[1] - 2 * page.lenses.top_mm - high
    assert np.abs(aside).max() < 2 * pixel_mm
    assert page.lenses.left_mm == pytest.approx(page.left_px * pixel_mm, abs=pixel_mm)


def test_a_pdf_on_paper_is_exactly_as_large_and_has_the_array_in_its_middle(tmp_path: Path) -> None:
    job = made(tmp_path, "print.pdf", page="letter")
    with job.file("exports/print/0001.pdf") as path:
        page = pypdf.PdfReader(path, strict=True).pages[0]
        contents = page.get_contents()
        assert contents is not None
        drawn = contents.get_data().decode("latin-1")
        assert [float(side) for side in page.mediabox.upper_right] == pytest.approx([612, 792], abs=0.01)
    matrix = re.search(r"([\d. ]+) cm\s+/FormXob", drawn)
    assert matrix is not None
    wide, _, _, high, left, bottom = (float(number) for number in matrix[1].split())
    assert (left + wide / 2, bottom + high / 2) == pytest.approx((306, 396), abs=PIXEL_MM / POINT_MM)


def test_a_tiff_on_paper_has_the_array_where_the_sidecar_puts_it(tmp_path: Path) -> None:
    job = made(tmp_path, "print.tif", file_format="tiff", page="a4")
    codes, _ = tiff_of(job)
    about = job.sidecar("print.tif")["format"]
    assert codes.shape[:2] == tuple(about["page_px"]) == (round(297 / PIXEL_MM), round(210 / PIXEL_MM))
    top, left = about["array_top_px"], about["array_left_px"]
    np.testing.assert_array_equal(codes[top : top + 61, left : left + 51], array_of(job, 8))


def test_the_mounting_sheet_says_in_mm_what_goes_where(tmp_path: Path) -> None:
    array = {"substrate_mm": 1.5}
    job = made(tmp_path, "print.tif", file_format="tiff", page="letter", lens_array=array)
    about = job.sidecar("print.tif")["format"]
    with job.file("exports/print/mounting.pdf") as path:
        page = pypdf.PdfReader(path, strict=True).pages[0]
        assert [float(side) for side in page.mediabox.upper_right] == pytest.approx([612, 792], abs=0.01)
        text = page.extract_text()
    left_mm, top_mm = (
        (about[place] + px / 2) * PIXEL_MM - lenses / 2
        for place, px, lenses in (("array_left_px", 51, 5), ("array_top_px", 61, 6))
    )
    for expected in (
        "Page: 215.9 mm wide, 279.4 mm high",
        "Array: 5.00 mm wide, 6.00 mm high",
        f"{left_mm:.2f} mm from the left edge",
        f"{top_mm:.2f} mm from its upper edge",
        f"gap {about['gap_mm']:.2f} mm",
        f"spacers of {about['gap_mm'] - 1.5:.2f} mm",
        "1.50 mm",
    ):
        assert expected in text


def test_a_gap_thinner_than_the_substrate_is_named_with_what_to_do(tmp_path: Path) -> None:
    asked = [{"kind": "print", "dpi": DPI, "file_format": "pdf"}]
    array, display = {"substrate_mm": 3.3, "offset_mm": 40.0}, {"gap_real_mm": 2.0}
    job = given_job(tmp_path, outputs=asked, lens_array=array, display=display)
    job.make("print.pdf")
    assert job.sidecar("print.pdf")["format"]["gap_is_thinner_than_substrate"]
    texts = {}
    for name in ("0001", "mounting"):
        with job.file(f"exports/print/{name}.pdf") as path:
            texts[name] = pypdf.PdfReader(path, strict=True).pages[0].extract_text()
    assert "gap 2.00 mm, thinner than the substrate of 3.30 mm" in texts["0001"]
    for expected in (
        "2.00 mm of 3.30 mm",
        "The gap of 2.00 mm is thinner than the substrate of 3.30 mm",
        "Grind the substrate down to 2.00 mm",
        "set display.gap_real_mm of the job to 3.30 mm or more",
    ):
        assert expected in texts["mounting"]
    assert "spacers of" not in texts["mounting"]


@pytest.mark.parametrize(
    ("offset_mm", "display", "use", "gap_mm"),
    [
        (40.0, {}, "real", None),
        (-40.0, {}, "virtual", None),
        (40.0, {"gap_real_mm": 4.8}, "real", 4.8),
    ],
)
def test_the_gap_of_a_print_is_that_of_the_design(
    tmp_path: Path, offset_mm: float, display: dict[str, float], use: str, gap_mm: float | None
) -> None:
    asked = [{"kind": "print", "dpi": DPI, "file_format": "png"}]
    job = given_job(tmp_path, outputs=asked, lens_array={"offset_mm": offset_mm}, display=display)
    job.make("print.png")
    about = job.sidecar("print.png")["format"]
    numbers = designer.design(job.sheet)
    assert about["gap_use"] == use
    assert about["gap_mm"] == getattr(numbers, f"gap_{use}_physical_mm")
    if gap_mm is not None:
        assert about["gap_mm"] == gap_mm


def test_a_print_without_a_mounting_sheet_has_none(tmp_path: Path) -> None:
    job = made(tmp_path, "print.tif", file_format="tiff", mounting_sheet=False)
    assert not any("mounting" in name for name in job.sidecar("print.tif")["files"])


@pytest.mark.parametrize(
    ("output", "rig", "field", "expected", "got"),
    [
        ({}, {}, "dpi", "this or pitch_um, as there is no rig.device", "neither"),
        ({"dpi": 600, "pitch_um": 42}, {}, "dpi", "either this or pitch_um", "both"),
        ({"dpi": 600, "margin_mm": 5}, {}, "margin_mm", "at least 11.5 mm", "5"),
        ({"dpi": 600, "margin_mm": 5, "label": False}, {}, "margin_mm", "at least 7.5 mm", "5"),
        ({"dpi": 600, "page": "a3"}, {}, "page", "'array', 'a4' or 'letter'", "a3"),
        ({"dpi": 600, "page": "a4", "margin_mm": 61}, {}, "page", "array, or fewer", "a4 for 212.0 x 212.0 mm"),
        (
            {"dpi": 600, "page": "a4", "orientation_deg": 90},
            {"lens_array": {"count": [280, 100]}, "px_per_lens": 8},
            "page",
            "array, or fewer",
            "a4 for 304.0 x 124.0 mm",
        ),
        ({"dpi": 600, "orientation_deg": 45}, {}, "orientation_deg", "0, 90, 180 or 270", "45"),
        ({"dpi": 50_000}, {}, "dpi", "at most 32768 px a side", "177166 px, 90 mm of pixels of 0.508 um"),
        ({"pitch_um": 1}, {}, "pitch_um", "at most 32768 px a side", "90000 px"),
        ({"dpi": 600, "margin_mm": 700}, {}, "margin_mm", "at most 32768 px a side", "35197 px"),
        (
            {"dpi": 10},
            {"lens_array": {"pitch_mm": 100, "count": [60, 5]}, "px_per_lens": 8},
            "file_format",
            "tiff or png for a page of more than 5080 mm a side",
            "pdf of 6000 mm",
        ),
    ],
)
def test_what_cannot_be_printed_is_said_by_field_when_the_job_arrives(
    output: dict[str, Any], rig: dict[str, Any], field: str, expected: str, got: str
) -> None:
    with pytest.raises(SpecError) as refused:
        parse_spec({"scene": "fish", "rig": rig, "outputs": ["centre.mp4", {"kind": "print", **output}]})
    (problem,) = refused.value.problems
    assert problem.field == f"outputs.1.{field}"
    assert expected in problem.expected
    assert got in problem.got
