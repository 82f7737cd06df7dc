"""Every format, read back by its definition and by a program that is not ours."""

from __future__ import annotations

import io
import subprocess
import sys
from pathlib import Path

import av
import numpy as np
import pytest
import tifffile
from hypothesis import given
from hypothesis.extra.numpy import arrays

from lippmann.errors import OutputError, StoreUnavailable
from tests.builders_coded import read_pfm, read_ppm
from worker.exports.netpbm import write_pfm, write_ppm
from worker.exports.npz import write_npz
from worker.exports.yuv import planes, write_frame


def test_a_pfm_is_what_its_definition_says_from_the_bottom_up(tmp_path: Path) -> None:
    values = np.array([[1.5, -2.0, np.nan], [0.25, np.inf, 7.0]], dtype=np.float32)
    write_pfm(tmp_path / "a.pfm", values)
    np.testing.assert_array_equal(read_pfm(tmp_path / "a.pfm"), values)
    assert (tmp_path / "a.pfm").read_bytes() == b"Pf\n3 2\n-1\n" + values[1].tobytes() + values[0].tobytes()


def test_openimageio_reads_the_pfm_upright(tmp_path: Path) -> None:
    values = np.arange(12, dtype=np.float32).reshape(3, 4)
    write_pfm(tmp_path / "a.pfm", values)
    oiiotool = str(Path(sys.executable).with_name("oiiotool"))  # it comes with OpenImageIO's wheel
    command = [oiiotool, "a.pfm", "-d", "float", "--compression", "none", "-o", "a.tif"]
    subprocess.run(command, cwd=tmp_path, check=True, capture_output=True)
    np.testing.assert_array_equal(tifffile.imread(tmp_path / "a.tif"), values)


def test_a_ppm_of_10_bits_has_two_bytes_a_code_the_high_one_first(tmp_path: Path) -> None:
    codes = np.array([[[0, 1, 1023], [256, 512, 3]]], dtype=np.uint16)
    write_ppm(tmp_path / "a.ppm", codes, bits=10)
    assert (tmp_path / "a.ppm").read_bytes() == b"P6\n2 1\n1023\n" + bytes((0, 0, 0, 1, 3, 255, 1, 0, 2, 0, 0, 3))
    read, highest = read_ppm(tmp_path / "a.ppm")
    assert highest == 1023
    np.testing.assert_array_equal(read, codes)


def test_ffmpeg_reads_the_ppm_as_the_same_part_of_white(tmp_path: Path) -> None:
    codes = np.random.default_rng(1).integers(0, 1024, (5, 7, 3)).astype(np.uint16)
    write_ppm(tmp_path / "a.ppm", codes, bits=10)
    with av.open(str(tmp_path / "a.ppm")) as container:
        frame = next(container.decode(video=0))
        read = frame.to_ndarray(format="rgb48le").astype(np.float64)
    np.testing.assert_allclose(read / 65535, codes / 1023, atol=1.5 / 65535)


@pytest.mark.parametrize(
    ("codes", "bits"),
    [
        (np.full((1, 1, 3), 1024, dtype=np.uint16), 10),
        (np.zeros((1, 1, 3), dtype=np.uint8), 10),
        (np.zeros((1, 1), dtype=np.uint16), 10),
        (np.zeros((1, 1, 3), dtype=np.uint16), 8),
    ],
)
def test_what_is_no_picture_of_these_codes_is_refused_and_leaves_nothing(
    tmp_path: Path, codes: np.ndarray, bits: int
) -> None:
    with pytest.raises(OutputError, match="expected codes"):
        write_ppm(tmp_path / "a.ppm", codes, bits=bits)
    assert not list(tmp_path.iterdir())


def test_a_folder_that_is_not_there_is_a_store_that_does_not_answer(tmp_path: Path) -> None:
    with pytest.raises(StoreUnavailable, match=r"cannot write a\.pfm"):
        write_pfm(tmp_path / "gone" / "a.pfm", np.zeros((1, 1), dtype=np.float32))


def bt709(rgb: np.ndarray) -> np.ndarray:
    """Return Y'CbCr of R'G'B' from 0 to 1, in video range, by ITU-R BT.709 items 3.2 to 3.5, not rounded."""
    y = rgb @ np.array([0.2126, 0.7152, 0.0722])
    return np.stack((219 * y + 16, 224 * (rgb[..., 2] - y) / 1.8556 + 128, 224 * (rgb[..., 0] - y) / 1.5748 + 128), -1)


@given(arrays(np.uint8, (4, 6, 3)))
def test_luma_is_the_standards_of_every_pixel_and_chroma_of_the_mean_of_four(codes: np.ndarray) -> None:
    luma, blue, red = planes(codes)
    exact = bt709(codes / 255)
    assert np.abs(luma - exact[..., 0]).max() <= 0.5 + 1e-4
    four = exact.reshape(2, 2, 3, 2, 3).mean(axis=(1, 3))
    assert np.abs(np.stack((blue, red), -1) - four[..., 1:]).max() <= 0.5 + 1e-4


def test_black_white_and_primaries_are_the_published_codes() -> None:
    patches = np.array([[0, 0, 0], [255, 255, 255], [255, 0, 0], [0, 255, 0], [0, 0, 255]], dtype=np.uint8)
    codes = np.repeat(np.repeat(patches[np.newaxis], 2, axis=0), 2, axis=1)
    told = [(int(y), int(cb), int(cr)) for y, cb, cr in zip(*(plane[0] for plane in _halved(codes)), strict=True)]
    # SMPTE 100 % colour bars in BT.709, 8 bits.
    assert told == [(16, 128, 128), (235, 128, 128), (63, 102, 240), (173, 42, 26), (32, 240, 118)]


def _halved(codes: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    luma, blue, red = planes(codes)
    return luma[:, ::2], blue, red


def test_a_frame_taller_than_what_is_worked_on_at_once_is_the_same_by_parts() -> None:
    codes = np.random.default_rng(2).integers(0, 256, (600, 4, 3)).astype(np.uint8)
    whole, parts = planes(codes), [planes(codes[start : start + 100]) for start in range(0, 600, 100)]
    for plane, cut in zip(whole, zip(*parts, strict=True), strict=True):
        np.testing.assert_array_equal(plane, np.concatenate(cut))


def test_a_frame_with_an_odd_side_is_refused() -> None:
    with pytest.raises(OutputError, match="even sides"):
        write_frame(io.BytesIO(), np.zeros((3, 4, 3), dtype=np.uint8))


@pytest.mark.parametrize("compress", [False, True])
def test_an_npz_is_read_by_numpy_and_is_the_same_bytes_again(tmp_path: Path, compress: bool) -> None:
    given_arrays = {
        "views": np.random.default_rng(3).random((2, 3, 4), dtype=np.float32).astype(np.float16),
        "exists": np.array([[True, False]]),
        "text": np.array('{"a": 1}'),
    }
    write_npz(tmp_path / "a.npz", given_arrays, compress=compress)
    write_npz(tmp_path / "b.npz", given_arrays, compress=compress)
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()
    with np.load(tmp_path / "a.npz", allow_pickle=False) as read:
        assert list(read) == list(given_arrays)
        for name, array in given_arrays.items():
            assert read[name].dtype == array.dtype
            np.testing.assert_array_equal(read[name], array)
