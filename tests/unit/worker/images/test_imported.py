"""Pictures of other programs, written by them, read as linear light."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tifffile
from PIL import Image

from lippmann.errors import ArtifactBroken, ArtifactMissing
from worker.images.colour import srgb_codes
from worker.images.imported import read_imported
from worker.images.write import write_channels, write_exr

RNG = np.random.default_rng(0)
CODES_8 = RNG.integers(0, 256, (9, 7, 3), dtype=np.uint8)
CODES_16 = RNG.integers(0, 65536, (9, 7, 3), dtype=np.uint16)


def test_codes_become_light_that_has_these_codes(tmp_path: Path) -> None:
    Image.fromarray(CODES_8).save(tmp_path / "a.png")
    tifffile.imwrite(tmp_path / "b.tif", CODES_16, photometric="rgb")
    assert np.array_equal(srgb_codes(read_imported(tmp_path / "a.png")), CODES_8)
    assert np.array_equal(srgb_codes(read_imported(tmp_path / "b.tif"), bits=16), CODES_16)


@pytest.mark.parametrize("dtype", [np.float16, np.float32])
def test_floating_numbers_are_light_already(tmp_path: Path, dtype: Any) -> None:
    light = RNG.random((5, 6, 3)).astype(dtype)
    tifffile.imwrite(tmp_path / "a.tif", light, photometric="rgb")
    assert np.array_equal(read_imported(tmp_path / "a.tif"), light)


def test_a_master_of_ours_is_read_as_it_is(tmp_path: Path) -> None:
    light = RNG.random((5, 6, 3)).astype(np.float16)
    write_exr(tmp_path / "a.exr", light, attributes={})
    assert np.array_equal(read_imported(tmp_path / "a.exr"), light)


def test_alpha_is_left_out_and_darkens_nothing(tmp_path: Path) -> None:
    alpha = RNG.integers(1, 255, (9, 7, 1), dtype=np.uint8)
    Image.fromarray(np.concatenate((CODES_8, alpha), axis=2)).save(tmp_path / "a.png")
    assert np.array_equal(srgb_codes(read_imported(tmp_path / "a.png")), CODES_8)


def test_grey_becomes_three_equal_channels(tmp_path: Path) -> None:
    Image.fromarray(CODES_8[..., 0]).save(tmp_path / "a.png")
    tifffile.imwrite(tmp_path / "b.tif", CODES_16[..., 0], photometric="minisblack")
    assert np.array_equal(srgb_codes(read_imported(tmp_path / "a.png")), CODES_8[..., [0, 0, 0]])
    assert np.array_equal(srgb_codes(read_imported(tmp_path / "b.tif"), bits=16), CODES_16[..., [0, 0, 0]])


@pytest.mark.parametrize("suffix", ["png", "tif"])
def test_a_file_cut_short_is_named(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"cut.{suffix}"
    noise = RNG.integers(0, 256, (120, 120, 3), dtype=np.uint8)
    Image.fromarray(noise).save(path)
    path.write_bytes(path.read_bytes()[:20_000])
    with pytest.raises(ArtifactBroken, match=f"cut.{suffix}"):
        read_imported(path)


def test_what_is_not_there_or_no_picture_or_has_other_channels_is_named(tmp_path: Path) -> None:
    with pytest.raises(ArtifactMissing, match=r"a\.png"):
        read_imported(tmp_path / "a.png")
    (tmp_path / "a.png").write_bytes(b"no picture")
    with pytest.raises(ArtifactBroken, match=r"a\.png"):
        read_imported(tmp_path / "a.png")
    numbers = np.zeros((4, 4, 2), dtype=np.float32)
    write_channels(tmp_path / "c.exr", [numbers], ["far", "near"], size=(4, 4), attributes={})
    with pytest.raises(ArtifactBroken, match=r"expected red, green and blue, or grey, got channels \('far', 'near'\)"):
        read_imported(tmp_path / "c.exr")
