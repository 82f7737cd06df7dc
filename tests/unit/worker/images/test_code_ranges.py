"""The numbers of files as light: which code is black, which is white, and how many bits a code has."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest
import tifffile
from PIL import Image

from lippmann.errors import ArtifactBroken
from worker.untrusted import decoded_rows, read_imported

COLS = 16


def _packed(values: list[int], bits: int) -> bytes:
    text = "".join(f"{value:0{bits}b}" for value in values)
    text += "0" * (-len(text) % 8)
    return int(text, 2).to_bytes(len(text) // 8, "big")


def _write_tiff(path: Path, values: list[int], *, bits: int, photometric: int) -> None:
    """Write a row of grey by hand: no library writes all depths."""
    data = _packed(values, bits)
    data += b"\0" * (len(data) % 2)
    shorts = {258: bits, 259: 1, 262: photometric, 277: 1}
    longs = {256: len(values), 257: 1, 273: 8, 278: 1, 279: len(data)}
    tags = [(tag, 3, struct.pack("<HH", value, 0)) for tag, value in shorts.items()]
    tags += [(tag, 4, struct.pack("<I", value)) for tag, value in longs.items()]
    table = b"".join(struct.pack("<HHI4s", tag, kind, 1, value) for tag, kind, value in sorted(tags))
    begin = b"II*\0" + struct.pack("<I", 8 + len(data)) + data
    path.write_bytes(begin + struct.pack("<H", len(tags)) + table + bytes(4))


@pytest.mark.parametrize("bits", [1, 2, 4, 8, 10, 12, 14, 16])
def test_a_tiff_in_which_0_is_white_is_no_negative(tmp_path: Path, bits: int) -> None:
    most = 2**bits - 1
    values = [round(most * place / (COLS - 1)) for place in range(COLS)]
    _write_tiff(tmp_path / "a.tif", values, bits=bits, photometric=0)
    light = read_imported(tmp_path / "a.tif", linear=True)[0, :, 0]
    np.testing.assert_allclose(light, 1 - np.array(values) / most, atol=2e-5)


def test_the_rows_of_a_tiff_in_which_0_is_white_are_no_negative(tmp_path: Path) -> None:
    codes = np.array([[0, 1, 65535]], np.uint16)
    tifffile.imwrite(tmp_path / "a.tif", codes, photometric="miniswhite")
    with decoded_rows(tmp_path / "a.tif", is_master=False, scratch=tmp_path) as rows:
        assert np.array_equal(rows.read(0, 1)[..., 0], 65535 - codes)


def test_floating_numbers_in_which_0_is_white_are_refused(tmp_path: Path) -> None:
    tifffile.imwrite(tmp_path / "a.tif", np.zeros((4, 5), np.float32), photometric="miniswhite")
    with pytest.raises(ArtifactBroken, match=r"a\.tif: expected 0 to be black in floating numbers, got .*WhiteIsZero"):
        read_imported(tmp_path / "a.tif")


@pytest.mark.parametrize(
    ("highest", "white"),
    [(100, 50), (255, 200), (1023, 1023), (4095, 4095), (4095, 1023), (65535, 4095)],
)
def test_a_white_level_counts_as_the_codes_of_a_pgm_do(tmp_path: Path, highest: int, white: int) -> None:
    codes = np.array([0, white // 2, white - 1, white, highest])
    number = ">u2" if highest > 255 else np.uint8
    (tmp_path / "a.pgm").write_bytes(b"P5\n5 1\n%d\n" % highest + codes.astype(number).tobytes())
    light = read_imported(tmp_path / "a.pgm", linear=True, white_level=white)[0, :, 0]
    np.testing.assert_allclose(light, np.minimum(codes / white, 1), atol=0.5 / 50 if highest == 100 else 1e-4)


@pytest.mark.parametrize("suffix", ["png", "tif"])
def test_a_white_level_of_twelve_bits_in_sixteen(tmp_path: Path, suffix: str) -> None:
    codes = np.array([[0, 1023, 4095, 5000]], np.uint16)
    if suffix == "png":
        Image.fromarray(codes).save(tmp_path / "a.png")
    else:
        tifffile.imwrite(tmp_path / "a.tif", codes, photometric="minisblack")
    light = read_imported(tmp_path / f"a.{suffix}", linear=True, white_level=4095)
    np.testing.assert_allclose(light[0, :, 0], [0, 1023 / 4095, 1, 1], atol=1e-6)


def test_a_white_level_of_packed_bits(tmp_path: Path) -> None:
    _write_tiff(tmp_path / "a.tif", [0, 1000, 2000, 4095], bits=12, photometric=1)
    light = read_imported(tmp_path / "a.tif", linear=True, white_level=2000)[0, :, 0]
    np.testing.assert_allclose(light, [0, 0.5, 1, 1], atol=1e-4)


def test_a_white_level_that_a_file_cannot_have_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.pgm").write_bytes(b"P5\n1 1\n1023\n\0\0")
    with pytest.raises(ArtifactBroken, match=r"a\.pgm: expected a white level of at most 1023, the highest code of"):
        read_imported(tmp_path / "a.pgm", white_level=4095)
    Image.new("L", (4, 4)).save(tmp_path / "a.png")
    with pytest.raises(ArtifactBroken, match=r"at most 255, the highest code of this PNG, got 4095"):
        read_imported(tmp_path / "a.png", white_level=4095)
    tifffile.imwrite(tmp_path / "a.tif", np.zeros((4, 5), np.uint16), photometric="miniswhite")
    with pytest.raises(ArtifactBroken, match=r"a\.tif: expected no white level, as 0 is white in this TIFF, got 4095"):
        read_imported(tmp_path / "a.tif", white_level=4095)
