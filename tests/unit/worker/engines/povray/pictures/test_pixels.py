"""The pixels of POV-Ray's EXR are those that OpenEXR reads, and nothing that is broken is taken for pixels."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from lippmann.errors import RenderFailed
from tests.pictures import read_tiff
from tests.unit.worker.images.pictures import HALVES
from worker.engines.engine import Region
from worker.engines.povray.pictures.pixels import read_bands, read_codes, read_region
from worker.images.write import write_exr

ROWS, COLS = 50, 40
WHOLE = Region(0, ROWS, 0, COLS)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("pixels")


@pytest.fixture(scope="module")
def smooth(folder: Path) -> tuple[Path, np.ndarray]:
    """Return a picture that shrinks, and its light."""
    light = (np.arange(ROWS * COLS * 3).reshape(ROWS, COLS, 3) // 7 / 1000).astype(np.float16)
    write_exr(folder / "smooth.exr", light, attributes={})
    return folder / "smooth.exr", light


@given(light=HALVES)
def test_every_pixel_is_as_openexr_wrote_it(folder: Path, light: np.ndarray) -> None:
    write_exr(folder / "a.exr", light, attributes={})
    rows, cols, _ = light.shape
    np.testing.assert_array_equal(read_region(folder / "a.exr", Region(0, rows, 0, cols)), light)


@given(data=st.data())
def test_a_region_is_that_part_of_the_whole(smooth: tuple[Path, np.ndarray], data: st.DataObject) -> None:
    path, light = smooth
    rows = sorted(data.draw(st.tuples(st.integers(0, ROWS - 1), st.integers(1, ROWS)).filter(lambda r: r[0] != r[1])))
    cols = sorted(data.draw(st.tuples(st.integers(0, COLS - 1), st.integers(1, COLS)).filter(lambda c: c[0] != c[1])))
    region = read_region(path, Region(*rows, *cols))
    np.testing.assert_array_equal(region, light[slice(*rows), slice(*cols)])
    assert region.flags.c_contiguous


def test_wavelength_bands_are_added_in_their_shares(tmp_path: Path) -> None:
    band = np.random.default_rng(3).random((3, ROWS, COLS, 3)).astype(np.float16)
    write_exr(tmp_path / "a.exr", np.concatenate([np.zeros((1, COLS, 3), np.float16), *band]), attributes={})
    weights = ((0.5, 0.0, 0.25), (0.5, 0.25, 0.75), (0.0, 0.75, 0.0))
    found = read_bands(tmp_path / "a.exr", Region(1, ROWS + 1, 2, COLS - 3), weights)
    expected = np.einsum("bc,brsc->rsc", np.array(weights), band.astype(np.float64))[:, 2 : COLS - 3]
    assert found.astype(np.float64) == pytest.approx(expected, abs=5e-4)
    whole = np.concatenate([band[0]] * 3)
    write_exr(tmp_path / "same.exr", whole, attributes={})
    np.testing.assert_array_equal(read_bands(tmp_path / "same.exr", WHOLE, weights), band[0])


def test_pixels_that_do_not_shrink_are_read_too(tmp_path: Path) -> None:
    bits = np.random.default_rng(7).integers(0, 2 * 0x7C00, (ROWS, COLS, 3))
    light = np.where(bits < 0x7C00, bits, bits - 0x7C00 + 0x8000).astype(np.uint16).view(np.float16)
    write_exr(tmp_path / "a.exr", light, attributes={})
    assert (tmp_path / "a.exr").stat().st_size > ROWS * COLS * 6
    np.testing.assert_array_equal(read_region(tmp_path / "a.exr", WHOLE), light)


def test_a_picture_cut_short_anywhere_behind_its_header_is_broken(
    smooth: tuple[Path, np.ndarray], tmp_path: Path
) -> None:
    data = smooth[0].read_bytes()
    cut = tmp_path / "cut.exr"
    for length in [*range(_table(data), len(data), 11), len(data) - 1]:
        cut.write_bytes(data[:length])
        with pytest.raises(RenderFailed, match=r"^POV-Ray ended well and left cut\.exr broken: "):
            read_region(cut, WHOLE)


def test_damaged_pixels_are_broken(smooth: tuple[Path, np.ndarray], tmp_path: Path) -> None:
    data = smooth[0].read_bytes()
    damaged = tmp_path / "damaged.exr"
    for position in range(_table(data), len(data), 13):
        damaged.write_bytes(data[:position] + bytes([data[position] ^ 0x55]) + data[position + 1 :])
        with pytest.raises(RenderFailed):
            read_region(damaged, WHOLE)


HOSTILE = {
    "rows that inflate to gigabytes": zlib.compress(bytes(10_000_000), 9)[:3000],
    "rows that inflate to too few bytes": zlib.compress(bytes(16 * COLS * 6 - 1)),
    "rows that are not deflated": b"x" * 100,
    "rows without their checksum": zlib.compress(bytes(16 * COLS * 6))[:-4],
    "rows with more behind them": zlib.compress(bytes(16 * COLS * 6)) + b"x",
    "rows cut short": zlib.compress(bytes(range(256)) * 15)[:-20],
}


@pytest.mark.promise("Scenes", "What a POV-Ray that was taken over leaves as pixels is refused, or is pixels.")
@pytest.mark.parametrize("name", HOSTILE)
def test_rows_that_lie_are_refused(smooth: tuple[Path, np.ndarray], tmp_path: Path, name: str) -> None:
    data = smooth[0].read_bytes()
    packed = struct.pack("<2i", 0, len(HOSTILE[name])) + HOSTILE[name]
    _first_chunk_is(tmp_path / "lie.exr", data, offset=len(data), more=packed)
    with pytest.raises(RenderFailed, match="the rows from 0"):
        read_region(tmp_path / "lie.exr", WHOLE)


@pytest.mark.parametrize("offset", [0, 2**31, 2**63, 2**64 - 1])
def test_rows_at_another_place_are_refused(smooth: tuple[Path, np.ndarray], tmp_path: Path, offset: int) -> None:
    _first_chunk_is(tmp_path / "lie.exr", smooth[0].read_bytes(), offset=offset)
    with pytest.raises(RenderFailed, match="the rows from 0"):
        read_region(tmp_path / "lie.exr", WHOLE)


@pytest.mark.parametrize("size", [-1, 0, 2**31 - 1])
def test_rows_of_another_size_are_refused(smooth: tuple[Path, np.ndarray], tmp_path: Path, size: int) -> None:
    data = smooth[0].read_bytes()
    _first_chunk_is(tmp_path / "lie.exr", data, offset=len(data), more=struct.pack("<2i", 0, size))
    with pytest.raises(RenderFailed, match=f"got {size} from 0"):
        read_region(tmp_path / "lie.exr", WHOLE)


def _table(data: bytes) -> int:
    """Return where the table of offsets is: its last entry is the only number that leads to the last chunk."""
    chunks = -(-ROWS // 16)
    last = next(at for at in range(len(data) - 8, 0, -1) if data[at : at + 4] == struct.pack("<i", (chunks - 1) * 16))
    return data.index(struct.pack("<Q", last)) - 8 * (chunks - 1)


def _first_chunk_is(path: Path, data: bytes, *, offset: int, more: bytes = b"") -> None:
    table = _table(data)
    path.write_bytes(data[:table] + struct.pack("<Q", offset) + data[table + 8 :] + more)


@given(codes=hnp.arrays(np.uint16, hnp.array_shapes(min_dims=2, max_dims=2, max_side=9).map(lambda size: (*size, 3))))
def test_the_codes_of_a_ppm_are_those_that_another_reader_finds(folder: Path, codes: np.ndarray) -> None:
    rows, cols, _ = codes.shape
    path = folder / "a.ppm"
    path.write_bytes(f"P6\n{cols} {rows}\n65535\n".encode() + codes.astype(">u2").tobytes())
    np.testing.assert_array_equal(read_codes(path), codes)
    np.testing.assert_array_equal(read_tiff(path), codes)


def test_a_ppm_that_is_cut_short_is_broken(tmp_path: Path) -> None:
    (tmp_path / "a.ppm").write_bytes(b"P6\n2 2\n65535\n" + bytes(22))
    with pytest.raises(RenderFailed, match="expected 2 x 2 px, got 11 codes"):
        read_codes(tmp_path / "a.ppm")
