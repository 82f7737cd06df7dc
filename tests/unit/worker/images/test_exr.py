"""OpenEXR masters there and back, and what is said of broken ones."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from OpenImageIO import ImageOutput, ImageSpec

from lippmann.errors import ArtifactBroken, ArtifactMissing, OutputError, StoreFull, StoreUnavailable
from tests.unit.worker.images.pictures import HALVES, noise
from worker.images.read import read_attributes, read_channels, read_rgb
from worker.images.write import write_channels, write_exr


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("exr")


@pytest.fixture
def master(tmp_path: Path) -> Path:
    write_exr(tmp_path / "master.exr", noise(50, 40), attributes={"rig": "{}"})
    return tmp_path / "master.exr"


@given(light=HALVES)
def test_half_floats_come_back_exactly(folder: Path, light: np.ndarray) -> None:
    write_exr(folder / "a.exr", light, attributes={})
    np.testing.assert_array_equal(read_rgb(folder / "a.exr", np.float16), light)
    np.testing.assert_array_equal(read_rgb(folder / "a.exr", np.float32), light.astype(np.float32))


def test_any_strides_are_written_as_they_look(tmp_path: Path) -> None:
    light = noise(20, 24)
    for name, turned in {
        "sheet": light[::-1, ::-1],
        "second": light[::2, ::3],
        "transposed": light.transpose(1, 0, 2),
        "fortran": np.asfortranarray(light),
    }.items():
        write_exr(tmp_path / f"{name}.exr", turned, attributes={})
        np.testing.assert_array_equal(read_rgb(tmp_path / f"{name}.exr", np.float16), turned)


def test_our_attributes_come_back_and_no_others(tmp_path: Path) -> None:
    attributes = {"rig": '{"lens": "Fresnel ä 630"}', "long": "x" * 100_000}
    write_exr(tmp_path / "a.exr", noise(4, 4), attributes=attributes)
    assert read_attributes(tmp_path / "a.exr") == attributes


def test_the_same_pixels_give_the_same_bytes_on_any_day(tmp_path: Path) -> None:
    for name in ("a.exr", "b.exr"):
        write_exr(tmp_path / name, noise(40, 40), attributes={"rig": "{}"})
    data = (tmp_path / "a.exr").read_bytes()
    assert data == (tmp_path / "b.exr").read_bytes()
    assert b"DateTime" not in data
    assert b"capDate" not in data


def test_light_beyond_half_floats_is_clipped_to_them(tmp_path: Path) -> None:
    light = np.array([[[1e6, -1e6, 2.0]]], dtype=np.float32)
    write_exr(tmp_path / "a.exr", light, attributes={})
    np.testing.assert_array_equal(read_rgb(tmp_path / "a.exr", np.float32), [[[65504.0, -65504.0, 2.0]]])


def test_a_file_cut_short_anywhere_is_broken(master: Path, tmp_path: Path) -> None:
    data = master.read_bytes()
    cut = tmp_path / "cut.exr"
    for length in [*range(0, len(data), 211), len(data) - 1]:
        cut.write_bytes(data[:length])
        with pytest.raises(ArtifactBroken, match=r"^cut\.exr: "):
            read_rgb(cut, np.float16)


def test_a_file_with_damaged_pixels_is_broken(master: Path, tmp_path: Path) -> None:
    data = master.read_bytes()
    damaged = tmp_path / "damaged.exr"
    for position in range(1000, len(data), 977):
        damaged.write_bytes(data[:position] + bytes([data[position] ^ 0x55]) + data[position + 1 :])
        with pytest.raises(ArtifactBroken):
            read_rgb(damaged, np.float16)


def test_what_is_not_there_is_missing(tmp_path: Path) -> None:
    for path in (tmp_path / "none.exr", tmp_path):
        with pytest.raises(ArtifactMissing, match="got no file"):
            read_rgb(path, np.float16)


def test_a_picture_without_colours_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "depth.exr"
    target = ImageOutput.create(str(path))
    assert target is not None
    assert target.open(str(path), ImageSpec(4, 4, 1, "half"))
    assert target.write_image(np.zeros((4, 4, 1), np.float16))
    assert target.close()
    with pytest.raises(ArtifactBroken, match=r"expected channels \('R', 'G', 'B'\), got \('Y',\)"):
        read_rgb(path, np.float16)


@pytest.mark.parametrize(
    "pixels", [np.zeros((4, 4), np.float16), np.zeros((4, 4, 4), np.float16), np.zeros((4, 4, 3), np.uint8)]
)
def test_what_is_not_linear_light_is_not_written(tmp_path: Path, pixels: np.ndarray) -> None:
    with pytest.raises(OutputError, match=r"expected linear light \(rows, cols, 3\)"):
        write_exr(tmp_path / "a.exr", pixels, attributes={})


def test_a_full_disk_is_said_and_nothing_is_left(tmp_path: Path) -> None:
    full = tmp_path / "full.exr"
    full.symlink_to("/dev/full")
    with pytest.raises(StoreFull, match=r"cannot write full\.exr: No space left"):
        write_exr(full, noise(40, 40), attributes={})
    assert not full.is_symlink()


def test_a_folder_that_is_not_there_is_said(tmp_path: Path) -> None:
    with pytest.raises(StoreUnavailable, match="No such file or directory"):
        write_exr(tmp_path / "none" / "a.exr", noise(4, 4), attributes={})


def test_numbers_come_back_by_their_names_in_any_order(tmp_path: Path) -> None:
    values = np.random.default_rng(1).normal(size=(9, 7, 3)).astype(np.float32)
    values[2, 3, 1] = np.nan
    bands = (values[:4], values[4:])
    write_channels(tmp_path / "n.exr", bands, ("z_mm", "s_mm", "a"), size=(9, 7), attributes={"job": "j"})
    np.testing.assert_array_equal(read_channels(tmp_path / "n.exr", ("a", "z_mm")), values[..., [2, 0]])
    np.testing.assert_array_equal(read_channels(tmp_path / "n.exr", ("s_mm",)), values[..., 1:2])
    assert read_attributes(tmp_path / "n.exr") == {"job": "j"}
    with pytest.raises(ArtifactBroken, match=r"expected channels \('depth',\), got"):
        read_channels(tmp_path / "n.exr", ("depth",))
