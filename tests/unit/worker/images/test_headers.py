"""What headers say beyond the size: orientation, pages, quality, inks; and how pictures are read by it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tifffile
from PIL import Image, ImageOps

from lippmann.errors import ArtifactBroken
from worker.images.colour import srgb_codes
from worker.images.foreign.header import read_header
from worker.images.foreign.notes import picture_notes
from worker.untrusted import picture_codes, read_imported

RNG = np.random.default_rng(1)
CODES = RNG.integers(0, 256, (9, 7, 3), dtype=np.uint8)
SMOOTH = np.repeat(np.repeat(RNG.integers(40, 200, (2, 3, 3), dtype=np.uint8), 16, axis=0), 16, axis=1)
"""Blocks of one colour, which JPEG changes little."""

_ORIENTATION = 274


def _tagged_tiff(path: Path, orientation: int) -> None:
    Image.fromarray(CODES).save(path, "tiff", tiffinfo={_ORIENTATION: orientation})


def _tagged_png(path: Path, orientation: int) -> None:
    exif = Image.Exif()
    exif[_ORIENTATION] = orientation
    Image.fromarray(CODES).save(path, "png", exif=exif)


def _tagged_jpeg(path: Path, orientation: int) -> None:
    exif = Image.Exif()
    exif[_ORIENTATION] = orientation
    Image.fromarray(SMOOTH).save(path, "jpeg", exif=exif, quality=95)


@pytest.mark.parametrize(
    ("save", "orientation"), [*((_tagged_tiff, number) for number in range(1, 9)), (_tagged_png, 6), (_tagged_jpeg, 8)]
)
def test_a_picture_is_turned_upright_as_another_program_turns_it(
    tmp_path: Path, save: Callable[[Path, int], None], orientation: int
) -> None:
    path = tmp_path / "a"
    save(path, orientation)
    with Image.open(path) as stored:
        # Pillow itself turns the pixels of a TIFF upright as it loads them, and of the others when it is asked.
        expected = np.asarray(ImageOps.exif_transpose(stored).convert("RGB")).astype(int)
    for codes in (srgb_codes(read_imported(path)), picture_codes(path)):
        assert codes.shape == expected.shape
        assert np.abs(codes - expected).max() <= (2 if save is _tagged_jpeg else 0)
    noted = any(
        f"its orientation tag is {orientation}, so it is turned upright" in one for one in picture_notes([path])
    )
    assert noted == (orientation != 1)


@pytest.mark.parametrize("quality", [1, 10, 30, 49, 50, 51, 75, 90, 95, 100])
@pytest.mark.parametrize("subsampling", ["4:4:4", "4:2:2", "4:2:0"])
def test_the_quality_of_a_jpeg_is_the_one_with_which_it_was_saved(
    tmp_path: Path, quality: int, subsampling: str
) -> None:
    Image.fromarray(CODES).save(tmp_path / "a.jpg", quality=quality, subsampling=subsampling)
    header = read_header(tmp_path / "a.jpg")
    assert (header.quality, header.quality_is_exact, header.chroma) == (quality, True, subsampling)
    assert (
        f"a.jpg: it is a JPEG of quality {quality} with {subsampling} chroma" in picture_notes([tmp_path / "a.jpg"])[0]
    )


def test_the_quality_by_other_tables_is_said_to_be_about_that(tmp_path: Path) -> None:
    tables = [[min(255, 3 + 2 * place) for place in range(64)]] * 2
    Image.fromarray(CODES).save(tmp_path / "a.jpg", qtables=tables)
    (note, *_) = picture_notes([tmp_path / "a.jpg"])
    assert "a JPEG of quality about " in note


@pytest.mark.parametrize("options", [{"subsampling": 2}, {"progressive": True}, {"quality": 60}])
def test_jpegs_are_read_as_another_decoder_reads_them(tmp_path: Path, options: dict[str, Any]) -> None:
    for name, codes in (("colour", SMOOTH), ("grey", SMOOTH[..., 0])):
        Image.fromarray(codes).save(tmp_path / f"{name}.jpg", **options)
        with Image.open(tmp_path / f"{name}.jpg") as stored:
            expected = np.asarray(stored.convert("RGB")).astype(int)
        assert np.abs(srgb_codes(read_imported(tmp_path / f"{name}.jpg")) - expected).max() <= 3


@pytest.mark.parametrize("kind", ["jpeg", "tiff"])
def test_inks_are_refused_as_what_they_are(tmp_path: Path, kind: str) -> None:
    Image.fromarray(np.zeros((9, 7, 4), np.uint8), "CMYK").save(tmp_path / "a", kind)
    with pytest.raises(ArtifactBroken, match="a: expected grey, or red, green and blue, got CMYK"):
        read_imported(tmp_path / "a")


def test_every_page_of_a_tiff_is_read_and_reduced_copies_are_no_pages(tmp_path: Path) -> None:
    pages = RNG.integers(0, 256, (3, 9, 7, 3), dtype=np.uint8)
    with tifffile.TiffWriter(tmp_path / "a.tif") as file:
        for page in pages:
            file.write(page, photometric="rgb", metadata=None)
            file.write(page[:4, :3], photometric="rgb", subfiletype=1, metadata=None)
    assert read_header(tmp_path / "a.tif").pages == (0, 2, 4)
    for number, page in enumerate(pages):
        assert np.array_equal(srgb_codes(read_imported(tmp_path / "a.tif", page=number)), page)
    with pytest.raises(ArtifactBroken, match="expected one picture, got 3 pages"):
        read_imported(tmp_path / "a.tif")
    with pytest.raises(ArtifactBroken, match="without page 4"):
        read_imported(tmp_path / "a.tif", page=3)
    Image.fromarray(CODES).save(tmp_path / "a.png")
    with pytest.raises(ArtifactBroken, match="expected a page 1 to 1, got 2"):
        read_imported(tmp_path / "a.png", page=1)


def test_directories_that_lead_back_are_walked_once(tmp_path: Path) -> None:
    tifffile.imwrite(tmp_path / "a.tif", CODES, photometric="rgb", metadata=None)
    data = bytearray((tmp_path / "a.tif").read_bytes())
    start = int.from_bytes(data[4:8], "little")
    count = int.from_bytes(data[start : start + 2], "little")
    data[start + 2 + 12 * count :][:4] = data[4:8]
    data[start + 2 + 12 * count : start + 6 + 12 * count] = data[4:8]
    (tmp_path / "a.tif").write_bytes(data)
    assert read_header(tmp_path / "a.tif").pages == (0,)


@pytest.mark.parametrize(
    ("begin", "codes"),
    [
        (b"P6\n2 1\n255\n", np.array([[[1, 2, 3], [4, 5, 255]]], np.uint8)),
        (b"P5 # a comment\n2\n1 255\n", np.array([[7, 255]], np.uint8)),
    ],
)
def test_ppm_and_pgm_are_read(tmp_path: Path, begin: bytes, codes: np.ndarray) -> None:
    (tmp_path / "a").write_bytes(begin + codes.tobytes())
    expected = codes if codes.ndim == 3 else codes[..., np.newaxis].repeat(3, axis=2)
    assert np.array_equal(srgb_codes(read_imported(tmp_path / "a")), expected)


def test_a_ppm_of_ten_bits_is_white_at_its_highest_code(tmp_path: Path) -> None:
    codes = np.array([[[0, 512, 1023]]], ">u2")
    (tmp_path / "a.ppm").write_bytes(b"P6\n1 1\n1023\n" + codes.tobytes())
    light = read_imported(tmp_path / "a.ppm", linear=True)
    np.testing.assert_allclose(light[0, 0], [0, 512 / 1023, 1], atol=1e-5)


def test_a_white_level_is_white(tmp_path: Path) -> None:
    codes = np.array([[0, 1023, 4095, 5000]], np.uint16)
    tifffile.imwrite(tmp_path / "a.tif", codes, photometric="minisblack")
    light = read_imported(tmp_path / "a.tif", linear=True, white_level=4095)
    np.testing.assert_allclose(light[0, :, 0], [0, 1023 / 4095, 1, 1], atol=1e-6)


def test_a_tag_that_libtiff_follows_in_its_own_way_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.tif"
    for orientation in (1, 6):
        image = Image.fromarray(SMOOTH).convert("YCbCr")
        image.save(path, "tiff", compression="jpeg", tiffinfo={_ORIENTATION: orientation})
        if orientation == 1:
            assert read_imported(path).shape == SMOOTH.shape
    with pytest.raises(ArtifactBroken, match="orientation tag 6 with YCbCr colours; convert the picture to RGB"):
        read_imported(path)
