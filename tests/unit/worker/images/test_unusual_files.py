"""Files that few programs write: they are read as what they are, or refused with the reason."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO
import pytest
import tifffile
from numpy.typing import NDArray
from PIL import Image

from lippmann.errors import ArtifactBroken
from worker.images.foreign.decoder import Refused, places
from worker.images.foreign.header import read_header
from worker.images.foreign.notes import picture_notes
from worker.untrusted import read_imported

RNG = np.random.default_rng(3)
CODES_16 = RNG.integers(0, 65536, (20, 24, 3), dtype=np.uint16)


@pytest.mark.parametrize(
    ("names", "expected"),
    [
        (["R", "G", "B"], [0, 1, 2]),
        (["A", "B", "G", "R"], [3, 2, 1]),
        (["Red", "Green", "Blue"], [0, 1, 2]),
        (["beauty.R", "beauty.G", "beauty.B"], [0, 1, 2]),
        (
            ["View Layer.Combined.A", "View Layer.Combined.B", "View Layer.Combined.G", "View Layer.Combined.R"],
            [3, 2, 1],
        ),
        (["R", "G", "B", "diffuse.R", "diffuse.G", "diffuse.B"], [0, 1, 2]),
        (["Depth.Z", "rgb.r", "rgb.g", "rgb.b"], [1, 2, 3]),
        (["Y"], [0, 0, 0]),
        (["Z", "Y"], [1, 1, 1]),
    ],
)
def test_red_green_and_blue_are_found_by_their_names(names: list[str], expected: list[int]) -> None:
    assert places(names, -1) == expected


@pytest.mark.parametrize(
    ("names", "said"),
    [
        (["left.R", "left.G", "left.B", "right.R", "right.G", "right.B"], r"of one layer, got .* \('left', 'right'\)"),
        (["BY", "RY", "Y"], "got luminance with chroma"),
        (["X", "Z"], r"or grey, got channels \('X', 'Z'\)"),
        (["a.R", "b.G", "c.B"], "or grey, got channels"),
    ],
)
def test_channels_that_are_not_clear_are_refused(names: list[str], said: str) -> None:
    with pytest.raises(Refused, match=said):
        places(names, -1)


def _write_mosaic(path: Path) -> None:
    tifffile.imwrite(path, CODES_16[..., 0], photometric="cfa", metadata=None)


def _write_lab(path: Path) -> None:
    Image.new("LAB", (24, 20)).save(path, "tiff")


def _write_volume(path: Path) -> None:
    numbers = np.zeros((5, 20, 24), np.uint8)
    tifffile.imwrite(path, numbers, photometric="minisblack", volumetric=True, tile=(1, 16, 16), metadata=None)


def _write_doubles(path: Path) -> None:
    tifffile.imwrite(path, CODES_16 / 65535, photometric="rgb", tile=(16, 16), metadata=None)


def _write_signed(path: Path) -> None:
    tifffile.imwrite(path, CODES_16[..., 0].astype(np.int16), photometric="minisblack", metadata=None)


@pytest.mark.parametrize(
    ("write", "said"),
    [
        (_write_mosaic, "got the mosaic of a sensor's colour filters; convert it to sRGB"),
        (_write_lab, r"got CIE L\*a\*b\*; convert it to sRGB"),
        (_write_volume, "got a volume of 5 layers"),
        (_write_doubles, "expected numbers of 16 or 32 bits in tiles, got 64"),
        (_write_signed, "expected 8 or 16 bits, or floating numbers, got int16"),
    ],
)
def test_a_tiff_that_would_be_misread_is_refused(tmp_path: Path, write: Any, said: str) -> None:
    write(tmp_path / "a.tif")
    with pytest.raises(ArtifactBroken, match=said):
        read_imported(tmp_path / "a.tif")


@pytest.mark.parametrize(
    "options",
    [
        {"byteorder": ">", "bigtiff": True, "tile": (16, 16)},
        {"byteorder": ">", "compression": "zlib", "predictor": True},
        {"bigtiff": True, "planarconfig": "separate"},
    ],
)
def test_any_order_of_the_numbers_of_a_tiff_is_read(tmp_path: Path, options: dict[str, Any]) -> None:
    codes = np.moveaxis(CODES_16, 2, 0) if "planarconfig" in options else CODES_16
    tifffile.imwrite(tmp_path / "a.tif", codes, photometric="rgb", metadata=None, **options)
    np.testing.assert_allclose(read_imported(tmp_path / "a.tif", linear=True), CODES_16 / 65535, atol=1e-6)


@pytest.mark.parametrize(
    "begin", [b"PF\r\n2 1\r\n-1.0\r\n", b"PF\n2 1\n-1.0\r\n", b"PF 2 1 -1.0\n", b"P6\n2 1\n255\r\n", b"P6\n2 1\n"]
)
def test_a_header_after_which_the_pixels_would_be_shifted_is_refused(tmp_path: Path, begin: bytes) -> None:
    (tmp_path / "a").write_bytes(begin + bytes(24))
    with pytest.raises(ArtifactBroken, match=r"expected a whole header of a P[FN]M picture, got other "):
        read_header(tmp_path / "a")


def test_other_parts_of_an_exr_are_noted(tmp_path: Path) -> None:
    path, light = tmp_path / "a.exr", np.ones((4, 5, 3), np.float32)
    parts = [OpenImageIO.ImageSpec(5, 4, 3, "half") for _ in "ab"]
    for name, part in zip("ab", parts, strict=True):
        part.attribute("oiio:subimagename", name)
    file = OpenImageIO.ImageOutput.create(str(path))
    assert file is not None
    assert file.open(str(path), tuple(parts))
    assert file.write_image(light)
    assert file.open(str(path), parts[1], "AppendSubimage")
    assert file.write_image(0 * light)
    file.close()
    assert picture_notes([path]) == ("a.exr: it has several parts, of which the first is read.",)
    shown: NDArray[np.float32] = read_imported(path)
    assert np.array_equal(shown, light)
