"""Colour spaces of PNG and TIFF files that were written by hand, chunk by chunk and profile by profile."""

from __future__ import annotations

import re
import struct
import zlib
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
import tifffile
from PIL import Image, ImageCms

from lippmann.errors import ArtifactBroken
from worker.images.foreign.colour_space import file_colour_space
from worker.images.foreign.notes import picture_notes
from worker.images.icc import profile_curve, srgb_profile
from worker.images.write import write_png
from worker.untrusted import picture_codes, read_imported

HALF = 0x8000 / 0xFFFF
"""The value of every code."""
SRGB = ((HALF + 0.055) / 1.055) ** 2.4
"""The light of that code in sRGB: 0.214."""


def chunk(name: bytes, content: bytes) -> bytes:
    return struct.pack(">I", len(content)) + name + content + struct.pack(">I", zlib.crc32(name + content))


def png(path: Path, *chunks: bytes) -> Path:
    """Write 3 x 2 px of 16 bits, every code 0x8000, with chunks before the pixels."""
    head = chunk(b"IHDR", struct.pack(">IIBBBBB", 3, 2, 16, 2, 0, 0, 0))
    pixels = chunk(b"IDAT", zlib.compress((b"\0" + b"\x80\0" * 9) * 2))
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + head + b"".join(chunks) + pixels + chunk(b"IEND", b""))
    return path


def gama(exponent: float) -> bytes:
    return chunk(b"gAMA", struct.pack(">I", round(100_000 / exponent)))


def cicp(transfer: int, *, primaries: int = 1, full_range: int = 1) -> bytes:
    return chunk(b"cICP", bytes((primaries, transfer, 0, full_range)))


def iccp(profile: bytes) -> bytes:
    return chunk(b"iCCP", b"a name\0\0" + zlib.compress(profile))


SRGB_CHUNK = chunk(b"sRGB", b"\0")

PRIMARIES = ((0.43607, 0.22249, 0.01392), (0.38515, 0.71687, 0.09708), (0.14307, 0.06061, 0.71410))
WIDE = ((0.6097, 0.3111, 0.0195), (0.2053, 0.6257, 0.0609), (0.1492, 0.0632, 0.7446))
"""Adobe RGB (1998), adapted to D50."""


def fixed(numbers: Sequence[float]) -> bytes:
    return struct.pack(f">{len(numbers)}i", *(round(number * 65536) for number in numbers))


def curv(*numbers: int) -> bytes:
    return b"curv\0\0\0\0" + struct.pack(f">I{len(numbers)}H", len(numbers), *numbers)


def para(kind: int, *numbers: float) -> bytes:
    return b"para\0\0\0\0" + struct.pack(">HH", kind, 0) + fixed(numbers)


def profile(*curves: bytes, primaries: Sequence[Sequence[float]] = PRIMARIES) -> bytes:
    """Return a display profile with one curve for all channels, with three, or without any."""
    tags = {
        name: b"XYZ \0\0\0\0" + fixed(place) for name, place in zip((b"rXYZ", b"gXYZ", b"bXYZ"), primaries, strict=True)
    }
    three = curves if len(curves) == 3 else curves * 3
    padded = [curve + b"\0" * (-len(curve) % 4) for curve in three]
    tags |= dict(zip((b"rTRC", b"gTRC", b"bTRC"), padded, strict=False))
    tags[b"wtpt"] = b"XYZ \0\0\0\0" + fixed((0.9642, 1.0, 0.8249))
    table, data = struct.pack(">I", len(tags)), b""
    for name, content in tags.items():
        table += struct.pack(">4sII", name, 132 + 12 * len(tags) + len(data), len(content))
        data += content
    size = 128 + len(table) + len(data)
    made = (2026, 1, 1, 0, 0, 0)
    head = struct.pack(">I4xI4s4s4s6H4s", size, 0x04000000, b"mntr", b"RGB ", b"XYZ ", *made, b"acsp")
    return (head.ljust(68, b"\0") + fixed((0.9642, 1.0, 0.8249))).ljust(128, b"\0") + table + data


LINEAR_TABLE = curv(*(round(65535 * place / 99) for place in range(100)))
SRGB_PARAMETRIC = para(3, 2.4, 1 / 1.055, 0.055 / 1.055, 1 / 12.92, 0.04045)

SPACES = {
    "gAMA 1.0": ((gama(1),), HALF, "gAMA chunk"),
    "gAMA 2.2": ((gama(2.2),), HALF**2.2, "gAMA chunk"),
    "gAMA 0.5": ((gama(0.5),), HALF**0.5, "gAMA chunk"),
    "sRGB": ((SRGB_CHUNK,), SRGB, "sRGB chunk"),
    "sRGB before gAMA": ((gama(1), SRGB_CHUNK), SRGB, "sRGB chunk"),
    "cICP linear": ((cicp(8),), HALF, "cICP chunk"),
    "cICP sRGB": ((cicp(13),), SRGB, "cICP chunk"),
    "cICP gamma 2.8": ((cicp(5),), HALF**2.8, "cICP chunk"),
    "cICP before all others": ((gama(2.2), SRGB_CHUNK, cicp(8)), HALF, "cICP chunk"),
    "ICC linear": ((iccp(profile(curv())),), HALF, "ICC profile"),
    "ICC linear table": ((iccp(profile(LINEAR_TABLE)),), HALF, "ICC profile"),
    "ICC gamma 1.8": ((iccp(profile(curv(round(1.8 * 256)))),), HALF ** (round(1.8 * 256) / 256), "ICC profile"),
    "ICC parametric gamma": ((iccp(profile(para(0, 2.2))),), HALF**2.2, "ICC profile"),
    "ICC parametric sRGB": ((iccp(profile(SRGB_PARAMETRIC)),), SRGB, "ICC profile"),
    "ICC before gAMA": ((gama(2.2), iccp(profile(curv()))), HALF, "ICC profile"),
    "our own sRGB profile": ((iccp(srgb_profile()),), SRGB, "ICC profile"),
}  # fmt: skip


@pytest.mark.parametrize("name", SPACES)
def test_a_png_is_read_by_the_colour_space_that_it_names(tmp_path: Path, name: str) -> None:
    chunks, light, known_by = SPACES[name]
    path = png(tmp_path / "a.png", *chunks)
    space = file_colour_space(path)
    assert space.known_by == known_by
    assert space.note is None
    np.testing.assert_allclose(read_imported(path), light, atol=2e-4)


UNKNOWN = {
    "nothing": ((), "no colour space is named"),
    "cICP of PQ": ((cicp(16),), r"the cICP chunk \(1, 16, 0, 1\) is none that can be decoded"),
    "cICP of narrow range": ((cicp(13, full_range=0),), "the cICP chunk"),
    "cICP cut short": ((chunk(b"cICP", b"\1\10"),), "the cICP chunk"),
    "gAMA of zero": ((chunk(b"gAMA", bytes(4)),), "no colour space is named"),
    "ICC with three curves": ((iccp(profile(curv(), curv(512), curv(512))),), "no single tone curve"),
    "ICC without curves": ((iccp(profile()),), "no single tone curve"),
}  # fmt: skip


@pytest.mark.parametrize("name", UNKNOWN)
def test_what_cannot_be_told_is_srgb_with_a_note(tmp_path: Path, name: str) -> None:
    chunks, note = UNKNOWN[name]
    path = png(tmp_path / "a.png", *chunks)
    assert file_colour_space(path).known_by is None
    (said,) = picture_notes([path])
    assert said.startswith("a.png: ")
    assert re.search(note, said)
    assert said.endswith("so the codes are read as sRGB.")
    np.testing.assert_allclose(read_imported(path), SRGB, atol=2e-4)


def test_linear_overrides_what_a_file_says(tmp_path: Path) -> None:
    for number, chunks in enumerate(((), (SRGB_CHUNK,), (gama(2.2),))):
        np.testing.assert_allclose(
            read_imported(png(tmp_path / f"{number}.png", *chunks), linear=True), HALF, atol=1e-6
        )


def test_primaries_other_than_those_of_srgb_are_noted_and_not_converted(tmp_path: Path) -> None:
    wide = png(tmp_path / "wide.png", iccp(profile(curv(), primaries=WIDE)))
    display_p3 = png(tmp_path / "p3.png", cicp(13, primaries=12))
    notes = picture_notes([wide, display_p3])
    assert notes == (
        "wide.png: its primaries (ICC profile) are not those of sRGB and are not converted.",
        "p3.png: its primaries (cICP chunk, primaries 12) are not those of sRGB and are not converted.",
    )
    np.testing.assert_allclose(read_imported(wide), HALF, atol=1e-6)
    np.testing.assert_allclose(read_imported(display_p3), SRGB, atol=2e-4)


def test_a_note_is_given_once_for_all_files(tmp_path: Path) -> None:
    files = [png(tmp_path / f"{number}.png") for number in range(3)]
    assert picture_notes(files) == ("0.png and 2 more: no colour space is named, so the codes are read as sRGB.",)


@pytest.mark.parametrize(
    ("icc", "light"),
    [(profile(curv()), HALF), (profile(SRGB_PARAMETRIC), SRGB), (profile(para(0, 2.2)), HALF**2.2), (None, SRGB)],
    ids=["linear", "sRGB", "gamma 2.2", "nothing"],
)
def test_a_tiff_is_read_by_its_icc_profile(tmp_path: Path, icc: bytes | None, light: float) -> None:
    path = tmp_path / "a.tif"
    tifffile.imwrite(path, np.full((2, 3, 3), 0x8000, dtype=np.uint16), photometric="rgb", iccprofile=icc)
    np.testing.assert_allclose(read_imported(path), light, atol=2e-4)
    assert bool(picture_notes([path])) == (icc is None)


def test_floating_numbers_are_linear_and_need_no_note(tmp_path: Path) -> None:
    path = tmp_path / "a.tif"
    tifffile.imwrite(path, np.full((2, 3, 3), 0.5, dtype=np.float32), photometric="rgb")
    assert file_colour_space(path).name == "linear"
    assert picture_notes([path]) == ()


def test_pictures_of_ours_and_of_pillow_s_srgb_profile_name_srgb(tmp_path: Path) -> None:
    write_png(tmp_path / "ours.png", np.full((2, 3, 3), 0.25, dtype=np.float32))
    pillow = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
    Image.new("RGB", (3, 2), (128, 128, 128)).save(tmp_path / "pillow.png", icc_profile=pillow)
    for name in ("ours.png", "pillow.png"):
        space = file_colour_space(tmp_path / name)
        assert (space.name, space.note) == ("sRGB", None)
        assert space.known_by is not None


def test_codes_to_compare_are_srgb_whatever_the_colour_space_of_the_file(tmp_path: Path) -> None:
    np.testing.assert_array_equal(picture_codes(png(tmp_path / "linear.png", gama(1))), 188)
    np.testing.assert_array_equal(picture_codes(png(tmp_path / "srgb.png", SRGB_CHUNK)), 128)
    np.testing.assert_array_equal(picture_codes(png(tmp_path / "unknown.png")), 128)
    np.testing.assert_array_equal(picture_codes(png(tmp_path / "said.png"), linear=True), 188)


def test_a_profile_cut_short_anywhere_is_no_error() -> None:
    for whole in (profile(curv()), profile(SRGB_PARAMETRIC), srgb_profile()):
        for length in range(len(whole)):
            profile_curve(whole[:length])


def test_a_thousand_chunks_before_the_pixels_are_not_all_read(tmp_path: Path) -> None:
    path = png(tmp_path / "a.png", *[chunk(b"teST", b"")] * 1001, gama(1))
    with pytest.raises(ArtifactBroken, match=r"a\.png: expected a whole header .*, got more than 1000 chunks"):
        file_colour_space(path)
