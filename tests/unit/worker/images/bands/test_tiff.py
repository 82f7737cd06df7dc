"""TIFF by bands, the density of prints, and the sRGB profile, as other readers see them."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as some
from PIL import Image, ImageCms

from lippmann.errors import OutputError, StoreFull
from tests.pictures import read_tiff, tags_of_tiff
from tests.unit.worker.images.pictures import decoded, noise
from worker.images.bands import tiff
from worker.images.bands.tiff import STRIP_ROWS, write_tiff_bands
from worker.images.colour import srgb_codes
from worker.images.density import Density
from worker.images.icc import srgb_profile
from worker.images.write import write_png, write_tiff


@pytest.mark.parametrize("bits", [8, 16])
def test_a_tiff_holds_the_codes_for_two_other_readers(tmp_path: Path, bits: int) -> None:
    linear, path = noise(2 * STRIP_ROWS + 7, 33, np.float32), tmp_path / "picture.tif"
    write_tiff(path, linear, bits=bits)
    expected = srgb_codes(linear, bits=bits)
    np.testing.assert_array_equal(read_tiff(path), expected)
    np.testing.assert_array_equal(decoded(path, "rgb24" if bits == 8 else "rgb48le"), expected)


@given(cuts=some.lists(some.integers(1, 200), max_size=6))
def test_bands_of_any_heights_make_the_same_file(cuts: list[int]) -> None:
    codes = np.random.default_rng(2).integers(0, 256, (150, 5, 3), dtype=np.uint8)
    files = []
    for bands in (np.split(codes, sorted(set(cuts) & set(range(1, 150)))), [codes]):
        files.append(io.BytesIO())
        write_tiff_bands(files[-1], bands, rows=150, cols=5, bits=8)
    assert files[0].getvalue() == files[1].getvalue()


def test_the_density_of_a_tiff_is_exact_and_a_png_keeps_whole_pixels_a_metre(tmp_path: Path) -> None:
    density, linear = Density(across=600.0, down=25.4 / 0.042), noise(3, 4, np.float32)
    write_tiff(tmp_path / "a.tif", linear, density=density)
    tags = tags_of_tiff(tmp_path / "a.tif")
    assert (tags["XResolution"], tags["ResolutionUnit"]) == (600, 2)
    assert (tags["YResolution"].numerator, tags["YResolution"].denominator) == (12700, 21)
    write_png(tmp_path / "a.png", linear, density=density)
    with Image.open(tmp_path / "a.png") as picture:
        assert picture.info["dpi"] == pytest.approx((23622 * 0.0254, 23810 * 0.0254))


def test_nothing_is_said_that_was_not_asked(tmp_path: Path) -> None:
    write_tiff(tmp_path / "a.tif", noise(3, 4, np.float32))
    tags = tags_of_tiff(tmp_path / "a.tif")
    assert not {"Software", "DateTime", "ImageDescription"} & set(tags)
    assert tags["ResolutionUnit"] == 1  # none: the resolution is that of a pixel that is as high as wide


@pytest.mark.parametrize(("most", "version"), [(7 * 5 * 3, 42), (7 * 5 * 3 - 1, 43)])
def test_what_a_tiff_is_not_sure_to_hold_is_a_bigtiff(
    most: int, version: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tiff, "CLASSIC_BYTES", most)
    linear, path = noise(7, 5, np.float32), tmp_path / "a.tif"
    write_tiff(path, linear, density=Density(across=600.0, down=300.0))
    assert path.read_bytes()[:4] == b"II" + bytes([version, 0])
    np.testing.assert_array_equal(read_tiff(path), srgb_codes(linear))
    assert tags_of_tiff(path)["YResolution"] == 300


@pytest.mark.parametrize(("rows", "cols", "bits"), [(5, 4, 8), (3, 4, 8), (4, 5, 8), (4, 4, 16)])
def test_bands_of_another_picture_are_refused(rows: int, cols: int, bits: int) -> None:
    with pytest.raises(OutputError, match="expected"):
        write_tiff_bands(io.BytesIO(), [np.zeros((4, 4, 3), np.uint8)], rows=rows, cols=cols, bits=bits)


def test_rows_beyond_the_last_strip_are_refused() -> None:
    bands = [np.zeros((STRIP_ROWS, 4, 3), np.uint8)] * 2
    with pytest.raises(OutputError, match=f"expected {STRIP_ROWS} rows of pixels, got {2 * STRIP_ROWS}"):
        write_tiff_bands(io.BytesIO(), bands, rows=STRIP_ROWS, cols=4, bits=8)


def test_a_full_disk_is_said_and_no_part_is_left(tmp_path: Path) -> None:
    path = tmp_path / "full.tif"
    path.symlink_to("/dev/full")
    with pytest.raises(StoreFull, match="No space left"):
        write_tiff(path, noise(300, 300, np.float32))
    assert not path.is_symlink()


def test_the_profile_means_the_same_colours_as_srgb_of_another_maker() -> None:
    profile = ImageCms.ImageCmsProfile(io.BytesIO(srgb_profile()))
    codes = np.random.default_rng(3).integers(0, 256, (64, 64, 3), dtype=np.uint8)
    codes[:, :2] = np.arange(256, dtype=np.uint8).reshape(64, 4)[:, :2, np.newaxis]
    shown = ImageCms.profileToProfile(Image.fromarray(codes), profile, ImageCms.createProfile("sRGB"))
    assert shown is not None
    assert np.abs(np.asarray(shown).astype(int) - codes).max() <= 1
