"""What people open: sRGB PNG and WebP, checked with another decoder and with the formula."""

from __future__ import annotations

import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from lippmann.errors import ArtifactBroken, ArtifactMissing, OutputError, StoreFull
from tests.pictures import read_png_16
from tests.srgb import encoded_srgb
from tests.unit.worker.images.pictures import SHAPES, decoded, noise
from worker.images.colour import srgb_codes
from worker.images.convert import png
from worker.images.encode import encoded, save
from worker.images.read import read_rgb
from worker.images.write import write_exr, write_png, write_thumbnail
from worker.untrusted import picture_codes

HALVES_FROM_BLACK_TO_WHITE = np.arange(0x3C01, dtype=np.uint16).view(np.float16)
"""Every half float from 0 to 1."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("png")


def write_codes(path: Path, codes: np.ndarray) -> None:
    with encoded(codes, to="png", store_as="uint16", attributes={}) as file:
        save(file, path)


@given(codes=hnp.arrays(np.uint16, SHAPES, elements=st.integers(0, 65535)))
def test_codes_of_16_bits_come_back_exactly(folder: Path, codes: np.ndarray) -> None:
    write_codes(folder / "a.png", codes)
    np.testing.assert_array_equal(read_png_16(folder / "a.png"), codes)
    np.testing.assert_array_equal(decoded(folder / "a.png", "rgb48be"), codes)


def test_all_16_bit_codes_come_back_exactly(tmp_path: Path) -> None:
    codes = np.arange(65536, dtype=np.uint16).reshape(256, 256, 1).repeat(3, axis=2)
    write_codes(tmp_path / "a.png", codes)
    np.testing.assert_array_equal(read_png_16(tmp_path / "a.png"), codes)


def test_all_16_bit_codes_are_rounded_to_8(tmp_path: Path) -> None:
    codes = np.arange(65536, dtype=np.uint16).reshape(256, 256, 1).repeat(3, axis=2)
    write_codes(tmp_path / "a.png", codes)
    np.testing.assert_array_equal(picture_codes(tmp_path / "a.png"), np.rint(codes / 257))


@pytest.mark.parametrize("bits", [8, 16])
def test_a_master_and_its_png_are_the_same_codes(tmp_path: Path, bits: int) -> None:
    linear = noise(23, 31).astype(np.float16)
    write_exr(tmp_path / "a.exr", linear, attributes={})
    write_png(tmp_path / "a.png", linear, bits=bits)
    codes = picture_codes(tmp_path / "a.exr")
    np.testing.assert_array_equal(codes, srgb_codes(linear))
    assert codes.dtype == picture_codes(tmp_path / "a.png").dtype == np.uint8
    # Rounded twice, a code between two may come to the other one.
    assert np.abs(picture_codes(tmp_path / "a.png").astype(int) - codes).max() <= (bits == 16)


@pytest.mark.parametrize("bits", [8, 16])
def test_srgb_is_the_formula_to_one_code_for_every_half_float(bits: int) -> None:
    linear = np.resize(HALVES_FROM_BLACK_TO_WHITE, (113, 136, 3))
    codes = srgb_codes(linear, bits=bits)
    expected = encoded_srgb(linear) * (2**bits - 1)
    assert codes.dtype == {8: np.uint8, 16: np.uint16}[bits]
    assert np.abs(codes - np.rint(expected)).max() <= 1
    assert codes.min() == 0
    assert codes.max() == 2**bits - 1


def test_codes_of_other_than_8_10_or_16_bits_are_refused(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="8, 10 or 16 bits, got 12"):
        srgb_codes(noise(2, 2), bits=12)
    with pytest.raises(OutputError, match="a PNG of 8 or 16 bits, got 10"):
        write_png(tmp_path / "a.png", noise(2, 2), bits=10)


@pytest.mark.parametrize("bits", [8, 10, 16])
def test_every_half_float_has_the_code_of_the_same_light_in_single_precision(bits: int) -> None:
    halves = np.arange(2**16, dtype=np.uint16).view(np.float16).reshape(256, 256, 1)
    light = np.concatenate((halves, halves[::-1], halves[:, ::-1]), axis=2)
    np.testing.assert_array_equal(srgb_codes(light, bits=bits), srgb_codes(light.astype(np.float32), bits=bits))


def test_light_out_of_range_is_black_or_white() -> None:
    linear = np.array([-1.0, -np.inf, np.nan, 1.5, 70000.0, np.inf], dtype=np.float32)
    codes = srgb_codes(np.repeat(linear[np.newaxis, :, np.newaxis], 3, axis=2))
    assert codes[0, :, 0].tolist() == [0, 0, 0, 255, 255, 255]


@pytest.mark.parametrize(("bits", "pixel_format"), [(8, "rgb24"), (16, "rgb48be")])
def test_the_services_png_shows_the_masters_colours(tmp_path: Path, bits: int, pixel_format: str) -> None:
    light = noise(30, 20)
    write_exr(tmp_path / "a.exr", light, attributes={})
    data = png(tmp_path / "a.exr", bits=bits)
    shown = decoded(data, pixel_format)
    assert shown.shape == (30, 20, 3)
    assert np.abs(shown - encoded_srgb(light) * (2**bits - 1)).max() < 1.2
    assert b"sRGB" in data
    write_png(tmp_path / "a.png", light, bits=bits)
    assert (tmp_path / "a.png").read_bytes() == data


def test_pictures_are_converted_in_many_threads_at_once(tmp_path: Path) -> None:
    paths = [tmp_path / f"{i}.exr" for i in range(4)]
    for i, path in enumerate(paths):
        write_exr(path, noise(64, 64 + i), attributes={})
    alone = [png(path) for path in paths]
    with ThreadPoolExecutor(8) as pool:
        assert list(pool.map(png, paths * 8)) == alone * 8


def test_no_descriptors_are_left_open(tmp_path: Path) -> None:
    write_exr(tmp_path / "a.exr", noise(8, 8), attributes={})
    png(tmp_path / "a.exr")
    before = len(os.listdir("/proc/self/fd"))
    for _ in range(5):
        png(tmp_path / "a.exr")
        write_thumbnail(tmp_path / "a.webp", noise(8, 8))
    assert len(os.listdir("/proc/self/fd")) == before


def test_a_png_cut_short_is_broken(tmp_path: Path) -> None:
    write_codes(tmp_path / "whole.png", np.random.default_rng(1).integers(0, 65536, (20, 30, 3), dtype=np.uint16))
    data = (tmp_path / "whole.png").read_bytes()
    cut = tmp_path / "cut.png"
    for length in range(0, len(data) - 16, 97):
        cut.write_bytes(data[:length])
        with pytest.raises(ArtifactBroken, match=r"^cut\.png: "):
            read_rgb(cut, np.float32)


def test_the_services_png_of_nothing_is_missing(tmp_path: Path) -> None:
    with pytest.raises(ArtifactMissing):
        png(tmp_path / "none.exr")


@pytest.mark.parametrize(("size", "small"), [((90, 60), (90, 60)), ((300, 600), (128, 256)), ((1000, 2), (256, 1))])
def test_a_thumbnail_fits_and_is_never_enlarged(tmp_path: Path, size: tuple[int, int], small: tuple[int, int]) -> None:
    write_thumbnail(tmp_path / "a.webp", np.full((*size, 3), 0.5, np.float16))
    shown = decoded(tmp_path / "a.webp", "rgb24")
    assert shown.shape == (*small, 3)
    assert np.abs(shown.astype(int) - 188).max() <= 2


@pytest.mark.parametrize("write", [write_png, write_thumbnail])
def test_a_full_disk_is_said_and_nothing_is_left(tmp_path: Path, write: object) -> None:
    full = tmp_path / "full"
    full.symlink_to("/dev/full")
    with pytest.raises(StoreFull, match="No space left"):
        write(full, noise(100, 100))  # type: ignore[operator]  # one of two functions
    assert not full.is_symlink()


def test_the_hosts_own_colour_configuration_changes_nothing() -> None:
    script = (
        "import numpy as np; from worker.images.colour import srgb_codes;"
        "print(srgb_codes(np.full((1, 1, 3), 0.5, np.float32)).ravel().tolist())"
    )
    environment = {**os.environ, "OCIO": "/nonexistent.ocio"}
    ended = subprocess.run([sys.executable, "-c", script], env=environment, capture_output=True, text=True, timeout=60)
    assert ended.stdout.strip() == "[188, 188, 188]", ended.stderr


def test_the_order_of_the_axes_in_memory_changes_no_code() -> None:
    linear = np.random.default_rng(1).random((4, 5, 3), dtype=np.float32)
    channels_first = np.ascontiguousarray(linear.transpose(2, 0, 1)).transpose(1, 2, 0)
    np.testing.assert_array_equal(srgb_codes(channels_first), srgb_codes(linear))
