"""The headers of pictures, within limits, by files of other programs and by files that lie."""

from __future__ import annotations

import zlib
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tifffile
from PIL import Image, ImageCms

from lippmann.errors import ArtifactBroken, ArtifactMissing
from tests.bombs import BOMBS, chunk, exr, jpeg, png, tiff
from worker.images.foreign.header import read_header
from worker.images.headers.picture import PROFILE_BYTES_AT_MOST
from worker.images.write import write_channels, write_exr

LIMITS = {"at_most_px": 2**27, "at_most_side_px": 32_768}
RNG = np.random.default_rng(0)
CODES = RNG.integers(0, 256, (9, 7, 3), dtype=np.uint8)


def _said(path: Path) -> tuple[Any, ...]:
    header = read_header(path, **LIMITS)
    return header.format, header.rows, header.cols, header.channels, header.pixel_bytes, header.is_light


@pytest.mark.parametrize("kind", ["png", "tiff", "jpeg"])
def test_headers_of_other_programs_are_read_whatever_the_suffix(tmp_path: Path, kind: str) -> None:
    Image.fromarray(CODES).save(tmp_path / "a.exr", kind)
    assert _said(tmp_path / "a.exr") == (kind.upper(), 9, 7, 3, 3, False)


@pytest.mark.parametrize("options", [{}, {"bigtiff": True}, {"byteorder": ">"}, {"tile": (16, 16)}])
def test_every_kind_of_tiff_is_read(tmp_path: Path, options: Any) -> None:
    tifffile.imwrite(tmp_path / "a.tif", CODES.astype(np.uint16), photometric="rgb", **options)
    assert _said(tmp_path / "a.tif") == ("TIFF", 9, 7, 3, 6, False)
    tifffile.imwrite(tmp_path / "a.tif", CODES.astype(np.float32), photometric="rgb", **options)
    assert _said(tmp_path / "a.tif") == ("TIFF", 9, 7, 3, 12, True)


def test_masters_and_their_channels_are_read(tmp_path: Path) -> None:
    write_exr(tmp_path / "a.exr", CODES.astype(np.float16), attributes={"rig": "{}"})
    assert _said(tmp_path / "a.exr") == ("EXR", 9, 7, 3, 6, True)
    assert read_header(tmp_path / "a.exr").texts["lippmann:rig"] == "{}"
    write_channels(tmp_path / "a.exr", [np.zeros((9, 7, 5), np.float32)], list("abcde"), size=(9, 7), attributes={})
    assert _said(tmp_path / "a.exr") == ("EXR", 9, 7, 5, 20, True)
    (tmp_path / "a.pfm").write_bytes(b"Pf\n7 9\n-1.0\n" + bytes(4 * 63))
    assert _said(tmp_path / "a.pfm") == ("PFM", 9, 7, 1, 4, True)


@pytest.mark.parametrize("kind", ["png", "tiff", "jpeg"])
def test_the_profile_of_a_picture_is_read(tmp_path: Path, kind: str) -> None:
    profile = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
    Image.fromarray(CODES).save(tmp_path / "a", kind, icc_profile=profile)
    assert read_header(tmp_path / "a", **LIMITS).icc == profile


def test_a_profile_that_unpacks_without_end_counts_as_none(tmp_path: Path) -> None:
    profile = zlib.compress(bytes(PROFILE_BYTES_AT_MOST + 1))
    (tmp_path / "a.png").write_bytes(png(4, 4, chunks=chunk(b"iCCP", b"name\0\0" + profile)))
    assert read_header(tmp_path / "a.png", **LIMITS).icc is None


@pytest.mark.parametrize("name", BOMBS)
def test_a_file_that_lies_is_refused_by_its_header(tmp_path: Path, name: str) -> None:
    data, message = BOMBS[name]
    (tmp_path / "a.png").write_bytes(data)
    with pytest.raises(ArtifactBroken) as refused:
        read_header(tmp_path / "a.png", **LIMITS)
    assert refused.value.message.startswith("a.png: expected ")
    assert message in refused.value.message


@pytest.mark.parametrize("data", [png(4, 4), tiff({}), exr(), exr(tile=(64, 64)), jpeg(4, 4)])
def test_every_beginning_of_a_file_is_a_header_or_is_refused(tmp_path: Path, data: bytes) -> None:
    for size in range(0, len(data), 3):
        (tmp_path / "a").write_bytes(data[:size])
        with suppress(ArtifactBroken):
            read_header(tmp_path / "a", **LIMITS)


def test_what_is_not_there_is_missing(tmp_path: Path) -> None:
    with pytest.raises(ArtifactMissing, match=r"a\.png"):
        read_header(tmp_path / "a.png", **LIMITS)
