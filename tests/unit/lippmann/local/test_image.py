"""`lippmann.IntegralImage`: inverses, the kind of an image, and files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lippmann import CellLayout, IntegralImage, save_picture
from lippmann.errors import BadInput, LayoutError
from lippmann.job.optics.rig import Rig
from lippmann.lightfield.depth.depth_map import CHANNELS, DepthMap
from lippmann.lightfield.sheet.orthoscopic import orthoscopic
from lippmann.plan.design.observed_display import observed_display
from lippmann.plan.sampling import frame_size
from tests.pictures import read_png
from tests.unit.lippmann.local.masters import master_of, rig_of
from worker.images.colour import srgb_codes
from worker.images.read import read_attributes
from worker.images.write import write_channels, write_exr

SQUARE = CellLayout(6, 7, 4)
LAYOUTS = (SQUARE, CellLayout(6, 7, 8, "hexagonal"), CellLayout(5, 7, 8, "hexagonal", first_row_shifted=True))
LENS: dict[str, Any] = {"pitch_mm": 0.5, "focal_length_mm": 2.5}


def noise(layout: CellLayout, seed: int = 1) -> np.ndarray:
    return np.random.default_rng(seed).random((layout.rows, layout.cols, 3), dtype=np.float32)


def image_of(layout: CellLayout, **more: Any) -> IntegralImage:
    return IntegralImage.from_array(noise(layout), layout=layout, **LENS, **more)


@pytest.mark.parametrize("layout", LAYOUTS, ids=str)
def test_from_views_is_the_inverse_of_views(layout: CellLayout) -> None:
    views = image_of(layout).views()
    assert views.shape == (layout.cell_rows, layout.cell_cols, layout.lens_rows, layout.lens_cols, 3)
    again = IntegralImage.from_views(views, layout=layout, **LENS)
    np.testing.assert_array_equal(again.views(), views)
    if layout.lattice == "square":
        np.testing.assert_array_equal(IntegralImage.from_views(views, **LENS).pixels, image_of(layout).pixels)


@pytest.mark.parametrize("layout", LAYOUTS, ids=str)
def test_a_view_is_the_one_of_all_views_on_square_pixels(layout: CellLayout) -> None:
    image = image_of(layout)
    every = image.views(square_pixels=True)
    for u, v in image.view_numbers:
        np.testing.assert_allclose(image.view(u, v), every[v, u], atol=1e-6)
    np.testing.assert_array_equal(image.view(), image.view(*image.centre))
    missing = set(np.ndindex(layout.cell_cols, layout.cell_rows)) - set(image.view_numbers)
    assert all(not image.views()[v, u].any() for u, v in missing)


@pytest.mark.parametrize("layout", LAYOUTS, ids=str)
def test_lenses_that_fill_an_array_are_counted(layout: CellLayout) -> None:
    image = IntegralImage.from_array(noise(layout), px_per_lens=layout.px_per_lens, lattice=layout.lattice)
    assert (image.layout.lens_rows, image.layout.lens_cols) == (layout.lens_rows, layout.lens_cols)


@pytest.mark.parametrize("layout", LAYOUTS[:2], ids=str)
def test_refocus_is_one_picture_of_the_stack_and_depth_0_the_mean_of_the_views(layout: CellLayout) -> None:
    image = image_of(layout)
    stack = image.focal_stack((-2.0, 0.0, 2.0))
    np.testing.assert_allclose(image.refocus(2.0), stack[2], atol=1e-6)
    mean = np.mean([image.view(u, v) for u, v in image.view_numbers], axis=0)
    np.testing.assert_allclose(stack[1], mean, atol=1e-5)
    assert image.refocus(2.0, method="ciir", px_per_lens=2).shape[1] == 2 * layout.lens_cols


USES = {
    "view": lambda image: image.view(),
    "views": lambda image: image.views(),
    "epi": lambda image: image.epi(lens_row=1),
    "refocus": lambda image: image.refocus(1.0),
    "refocus by ciir": lambda image: image.refocus(1.0, method="ciir"),
    "focal stack": lambda image: image.focal_stack((0.0, 1.0)),
    "all in focus": lambda image: image.all_in_focus((0.0, 1.0)),
    "depth-focused view": lambda image: image.depth_focused_view(5.0),
    "depth": lambda image: image.depth(),
    "true depth": lambda image: image.true_depth(),
    "perspective": lambda image: image.perspective((0.0, 0.0, 300.0)),
    "observe": lambda image: image.observe((0.0, 0.0, 300.0), size_px=20, rays=1),
}


@pytest.mark.parametrize("use", USES)
def test_a_pseudoscopic_image_is_refused_until_it_is_converted(use: str) -> None:
    depth = DepthMap(np.ones((SQUARE.rows, SQUARE.cols, 4), np.float32))
    captured = IntegralImage(pixels=noise(SQUARE), layout=SQUARE, pseudoscopic=True, depth_map=depth, **LENS)
    with pytest.raises(LayoutError, match="expected an orthoscopic integral image, got a pseudoscopic one"):
        USES[use](captured)
    USES[use](captured.orthoscopic())


@pytest.mark.parametrize("inverted", [False, True])
@pytest.mark.parametrize("layout", LAYOUTS, ids=str)
def test_the_conversion_is_that_of_the_farm_and_takes_the_depth_along(layout: CellLayout, inverted: bool) -> None:
    values = np.random.default_rng(2).random((layout.rows, layout.cols, 4), dtype=np.float32)
    captured = IntegralImage(
        pixels=noise(layout), layout=layout, pseudoscopic=True, inverted=inverted, depth_map=DepthMap(values), **LENS
    )
    upright = captured.orthoscopic()
    np.testing.assert_array_equal(upright.pixels, orthoscopic(noise(layout), layout, inverted=inverted))
    assert upright.depth_map is not None
    np.testing.assert_array_equal(upright.depth_map.values, orthoscopic(values, layout, inverted=inverted))
    assert upright.orthoscopic() is upright


@pytest.mark.parametrize("more", [{}, {"pseudoscopic": True}, {"pseudoscopic": True, "inverted": True}], ids=str)
@pytest.mark.parametrize("layout", [*LAYOUTS[:2], CellLayout(5, 7, 8, "hexagonal")], ids=str)
def test_an_image_comes_back_from_its_file(layout: CellLayout, more: dict[str, bool], tmp_path: Path) -> None:
    image = image_of(layout, **more)
    image.save(tmp_path / "a.exr")
    again = IntegralImage.open(tmp_path / "a.exr")
    np.testing.assert_array_equal(again.pixels, image.pixels.astype(np.float16))
    for name in ("layout", "pitch_mm", "focal_length_mm", "pseudoscopic", "inverted"):
        assert getattr(again, name) == getattr(image, name), name
    assert [path.name for path in tmp_path.iterdir()] == ["a.exr"]


def test_a_hexagonal_image_whose_first_row_is_shifted_needs_an_odd_number_of_rows_in_a_file(tmp_path: Path) -> None:
    image_of(LAYOUTS[2]).save(tmp_path / "a.exr")
    assert IntegralImage.open(tmp_path / "a.exr").layout == LAYOUTS[2]
    even = CellLayout(6, 7, 8, "hexagonal", first_row_shifted=True)
    with pytest.raises(LayoutError, match="expected lenses that a rig can describe"):
        image_of(even).save(tmp_path / "b.exr")
    assert not (tmp_path / "b.exr").exists()


@pytest.mark.parametrize("suffix", [".png", ".tif"])
def test_codes_are_decoded_to_linear_light(suffix: str, tmp_path: Path) -> None:
    image = image_of(SQUARE)
    image.save(tmp_path / f"a{suffix}", bits=16)
    again = IntegralImage.open(tmp_path / f"a{suffix}", layout=SQUARE, **LENS)
    np.testing.assert_allclose(again.pixels, image.pixels, atol=1e-4)
    codes = srgb_codes(image.pixels)
    np.testing.assert_allclose(IntegralImage.from_array(codes, layout=SQUARE).pixels, image.pixels, atol=5e-3)


@pytest.mark.parametrize("lattice", ["square", "hexagonal"])
def test_a_master_is_opened_with_its_rig_its_display_and_its_depth(lattice: str, tmp_path: Path) -> None:
    rig = rig_of(lattice)
    master = master_of(tmp_path, rig)
    image = IntegralImage.open(master)
    assert (image.rig, image.depth_map, image.shown_on()) == (rig, None, observed_display(rig))
    values = np.ones((*image.pixels.shape[:2], 4), dtype=np.float32)
    (tmp_path / "depth").mkdir()
    path = tmp_path / "depth" / "0001.exr"
    write_channels(path, (values,), CHANNELS, size=values.shape[:2], attributes={})
    depth = IntegralImage.open(master, with_depth=True).true_depth()
    assert depth.source == "truth"
    assert (depth.s_mm == 1).all()
    with pytest.raises(LayoutError, match="expected an image with a depth map"):
        image.true_depth()


def test_a_capture_is_pseudoscopic_by_its_folder_and_inverted_by_its_lens(tmp_path: Path) -> None:
    for lens in ("athineos-2006", None):
        rig = Rig.model_validate({"imaging_lens": lens, "px_per_lens": 4, "lens_array": {"count": (6, 7)}})
        path = tmp_path / str(lens) / "integral" / "0001.exr"
        path.parent.mkdir(parents=True)
        write_exr(path, noise(frame_size(rig)), attributes={"rig": rig.model_dump_json()})
        image = IntegralImage.open(path)
        assert (image.pseudoscopic, image.inverted) == (True, lens is not None)
        # A saved image tells what it is in any folder.
        image.orthoscopic().save(path)
        assert not IntegralImage.open(path).pseudoscopic
        assert read_attributes(path)["kind"] == "orthoscopic"


def test_a_notebook_shows_a_small_picture() -> None:
    png = image_of(CellLayout(150, 200, 8))._repr_png_()
    assert png.startswith(b"\x89PNG")
    assert (int.from_bytes(png[16:20], "big"), int.from_bytes(png[20:24], "big")) == (640, 480)
    assert "7 x 6 lenses of 4 px" in str(image_of(SQUARE))
    assert "array" not in repr(image_of(SQUARE))


def test_a_picture_is_saved_with_its_pixels_repeated(tmp_path: Path) -> None:
    grey = noise(SQUARE)[..., 0]
    save_picture(grey, tmp_path / "grey.png", scale=2)
    codes = read_png(tmp_path / "grey.png")
    np.testing.assert_array_equal(codes[::2, 1::2, 1], srgb_codes(grey[..., np.newaxis].repeat(3, axis=2))[..., 0])


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: IntegralImage.from_array(noise(SQUARE), px_per_lens=5), "do not divide among"),
        (lambda: IntegralImage.from_array(noise(SQUARE)), "expected either a layout or px_per_lens"),
        (lambda: IntegralImage.from_array(noise(SQUARE).astype(int), layout=SQUARE), "as floating numbers, got int64"),
        (lambda: image_of(SQUARE, inverted=True), "expected inverted only of a pseudoscopic image"),
        (lambda: IntegralImage.from_array(noise(SQUARE), layout=SQUARE, pitch_mm=0.0), "positive pitch in mm, got 0"),
        (lambda: IntegralImage.from_views(noise(SQUARE)), "expected views (v, u, lens_row, lens_col, channel)"),
        (lambda: IntegralImage.from_views(np.ones((2, 3, 4, 5, 3))), "expected 3 x 3 views of 5 x 4 lenses"),
        (lambda: image_of(SQUARE).view(1), "expected both u and v"),
        (lambda: image_of(SQUARE).view(4, 0), "expected a view from (0, 0) to (3, 3), got (4, 0)"),
        (lambda: image_of(SQUARE).epi(), "expected either lens_row or lens_col"),
        (lambda: image_of(SQUARE).refocus(1.0, px_per_lens=3), "expected px_per_lens with the method ciir only"),
        (lambda: image_of(SQUARE).perspective((0, 0, -1)), "expected an eye in front of the display"),
    ],
)
def test_what_cannot_be_is_refused(make: Any, message: str) -> None:
    with pytest.raises(LayoutError) as refused:
        make()
    assert message in refused.value.message


def test_files_that_are_no_integral_image_are_refused(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("lenses")
    image_of(SQUARE).save(tmp_path / "a.png")
    image_of(SQUARE).save(tmp_path / "a.exr")
    refused: tuple[tuple[str, dict[str, Any], str], ...] = (
        ("gone.exr", {}, "there is no such file"),
        ("notes.txt", {}, "expected an integral image as .png, .tif, .tiff, .exr"),
        ("a.png", {}, "or a layout of the lenses, got neither"),
        ("a.exr", {"layout": SQUARE}, "expected no layout, as the header"),
    )
    for name, more, message in refused:
        with pytest.raises(BadInput, match=message):
            IntegralImage.open(tmp_path / name, **more)
    with pytest.raises(BadInput, match="expected an EXR, a PNG or a TIFF to write"):
        image_of(SQUARE).save(tmp_path / "a.jpg")
