"""Pictures of other programs, written by them, decoded in the sandbox as linear light; and files that lie."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tifffile
from PIL import Image

from lippmann.errors import ArtifactBroken, ArtifactMissing, SandboxMissing, Stopped
from lippmann.lightfield.depth.depth_map import CHANNELS
from tests.bombs import LIES
from worker import untrusted
from worker.images.bands import rows
from worker.images.colour import srgb_codes
from worker.images.foreign import decoder
from worker.images.read import read_rgb
from worker.images.write import write_channels, write_exr
from worker.sandbox.groups import Groups
from worker.sandbox.sandbox import Sandbox
from worker.untrusted import decoded_rows, picture_codes, read_depth_numbers, read_imported, read_master_light

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


def test_the_content_chooses_the_reader_and_a_format_that_is_not_read_is_named(tmp_path: Path) -> None:
    tifffile.imwrite(tmp_path / "a.png", CODES_16, photometric="rgb")
    assert np.array_equal(srgb_codes(read_imported(tmp_path / "a.png"), bits=16), CODES_16)
    Image.fromarray(CODES_8).save(tmp_path / "b.png", "gif")
    with pytest.raises(ArtifactBroken, match=r"b\.png: expected PNG, TIFF, EXR, JPEG, PFM or PNM, got GIF"):
        read_imported(tmp_path / "b.png")


def test_jpeg_and_pfm_are_read(tmp_path: Path) -> None:
    Image.fromarray(np.full((9, 7, 3), 100, np.uint8)).save(tmp_path / "a.jpg", quality=100)
    assert np.array_equal(srgb_codes(read_imported(tmp_path / "a.jpg")), np.full((9, 7, 3), 100, np.uint8))
    light = RNG.random((5, 6, 3)).astype("<f4")
    (tmp_path / "a.pfm").write_bytes(b"PF\n6 5\n-1.0\n" + light[::-1].tobytes())
    assert np.array_equal(read_imported(tmp_path / "a.pfm"), light)


def test_tiles_interlacing_and_a_window_elsewhere_are_read(tmp_path: Path) -> None:
    codes = RNG.integers(0, 256, (70, 50, 3), dtype=np.uint8)
    tifffile.imwrite(tmp_path / "a.tif", codes, photometric="rgb", tile=(16, 16))
    assert np.array_equal(srgb_codes(read_imported(tmp_path / "a.tif")), codes)
    palette = Image.fromarray(codes).quantize(16)
    palette.save(tmp_path / "b.png")
    assert np.array_equal(srgb_codes(read_imported(tmp_path / "b.png")), np.asarray(palette.convert("RGB")))


@pytest.mark.parametrize("name", LIES)
def test_pixels_that_are_not_there_are_refused_in_the_sandbox(tmp_path: Path, name: str) -> None:
    (tmp_path / "a.png").write_bytes(LIES[name])
    before = set(tmp_path.iterdir())
    with pytest.raises(ArtifactBroken, match=r"^a\.png: "):
        read_imported(tmp_path / "a.png", scratch=tmp_path)
    assert set(tmp_path.iterdir()) == before


EVIL = {
    "a link": "os.symlink({secret!r}, 'pixels.raw')",
    "a fifo": "os.mkfifo('pixels.raw')",
    "a folder": "os.mkdir('pixels.raw')",
    "nothing": "pass",
    "too much": "open('pixels.raw', 'wb').write(bytes(9 * 7 * 3 + 1))",
    "a file without end": "f = open('pixels.raw', 'wb')\nwhile True: f.write(bytes(1 << 20))",
    "a file elsewhere": "open({secret!r}, 'w').write('out')",
    "a word that is no type": "open('pixels.raw', 'wb').write(bytes(9 * 7 * 3))\nprint('object')",
}
"""What a decoder that a picture has taken over may do."""


@pytest.mark.parametrize("name", EVIL)
def test_a_decoder_that_was_taken_over_leaves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    secret = tmp_path / "secret"
    secret.write_bytes(bytes(9 * 7 * 3))
    evil = tmp_path / "evil.py"
    evil.write_text(f"import os\n{EVIL[name].format(secret=str(secret))}\nprint('uint8')\n")
    if "print('object')" in EVIL[name]:
        evil.write_text(evil.read_text().removesuffix("print('uint8')\n"))
    monkeypatch.setattr(decoder, "__file__", str(evil))
    Image.fromarray(CODES_8).save(tmp_path / "a.png")
    with pytest.raises(ArtifactBroken, match=r"^a\.png: "):
        read_imported(tmp_path / "a.png")
    assert secret.read_bytes() == bytes(9 * 7 * 3)


def test_masters_and_depths_of_others_are_decoded_in_the_sandbox(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    light, depth = RNG.random((5, 6, 3)).astype(np.float32), RNG.random((5, 6, 4)).astype(np.float32)
    write_exr(tmp_path / "a.exr", light, attributes={})
    write_channels(tmp_path / "d.exr", [depth], CHANNELS, size=(5, 6), attributes={})
    assert np.array_equal(picture_codes(tmp_path / "a.exr"), srgb_codes(light.astype(np.float16)))
    assert np.array_equal(read_depth_numbers(tmp_path / "d.exr", CHANNELS), depth)
    with pytest.raises(ArtifactBroken, match=r"a\.exr: expected channels \('z_mm', .* got \('R', 'G', 'B'\)"):
        read_depth_numbers(tmp_path / "a.exr", CHANNELS)
    evil = tmp_path / "evil.py"
    evil.write_text("print('half')\n")
    monkeypatch.setattr(decoder, "__file__", str(evil))
    for name, read in (
        ("a", picture_codes),
        ("d", lambda path: read_depth_numbers(path, CHANNELS)),
        ("a", lambda path: decoded_rows(path, is_master=True).__enter__()),
    ):
        with pytest.raises(ArtifactBroken, match=rf"{name}\.exr: expected numbers from the decoder, got no file"):
            read(tmp_path / f"{name}.exr")


@pytest.mark.parametrize(("codes", "suffix"), [(CODES_8, "png"), (CODES_8, "tif"), (CODES_16, "tif")])
def test_the_rows_of_a_picture_are_read_in_any_order(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, codes: np.ndarray, suffix: str
) -> None:
    monkeypatch.setattr(rows, "BAND_BYTES", 50)
    path = tmp_path / f"a.{suffix}"
    if suffix == "png":
        Image.fromarray(codes).save(path)
    else:
        tifffile.imwrite(path, codes, photometric="rgb")
    with decoded_rows(path, is_master=False, scratch=tmp_path) as picture:
        assert (picture.rows, picture.cols, picture.dtype) == (9, 7, codes.dtype)
        for start in (7, 3, 0):
            assert np.array_equal(picture.read(start, start + 2), codes[start : start + 2])
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("read", [picture_codes, read_master_light], ids=lambda read: read.__name__)
def test_a_master_that_is_no_exr_is_named(tmp_path: Path, read: Callable[[Path], object]) -> None:
    Image.fromarray(CODES_8).save(tmp_path / "a.exr", "png")
    with pytest.raises(ArtifactBroken, match=r"a\.exr: expected EXR, got PNG"):
        read(tmp_path / "a.exr")


def test_a_stop_is_heard_while_a_picture_is_decoded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    endless = tmp_path / "endless.py"
    endless.write_text("while True: pass\n")
    monkeypatch.setattr(decoder, "__file__", str(endless))
    Image.fromarray(CODES_8).save(tmp_path / "a.png")
    with pytest.raises(Stopped):
        read_imported(tmp_path / "a.png", should_stop=lambda: True)
    monkeypatch.setattr(untrusted, "START_S", 1.0)
    with pytest.raises(ArtifactBroken, match=r"a\.png: expected a picture that is decoded within .* the size of"):
        read_imported(tmp_path / "a.png")


def test_what_is_read_without_a_sandbox_has_one_reader_too(tmp_path: Path) -> None:
    Image.fromarray(CODES_8).save(tmp_path / "a.exr", "png")
    assert np.allclose(read_rgb(tmp_path / "a.exr", np.float32), CODES_8 / 255)
    Image.fromarray(CODES_8).save(tmp_path / "b.exr", "gif")
    with pytest.raises(ArtifactBroken, match=r"b\.exr: expected PNG, TIFF, EXR, JPEG, PFM or PNM, got GIF"):
        read_rgb(tmp_path / "b.exr", np.float32)


def test_a_program_of_the_sandbox_that_is_not_there_is_no_fault_of_the_picture(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(untrusted, "PATH", str(tmp_path))
    Image.fromarray(CODES_8).save(tmp_path / "a.png")
    entered = Sandbox("none", allow_none=True, groups=Groups((tmp_path,)))
    with pytest.raises(SandboxMissing, match=r"did not start: enter: .*not found"):
        read_imported(tmp_path / "a.png", sandbox=entered)
