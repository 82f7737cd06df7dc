"""Pictures in bands of rows: the same file as the whole, and checked like it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from OpenImageIO import ImageOutput, ImageSpec

from lippmann.errors import ArtifactBroken, ArtifactMissing, OutputError, StoreFull, StoreUnavailable
from lippmann.lattice.cell import Lattice
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.sheet.bands import HeldRows, SheetOfRows
from lippmann.lightfield.views.views import views_grid
from tests.pictures import read_tiff
from tests.unit.worker.images.pictures import decoded, noise
from worker.images.bands import rearrange as views_module
from worker.images.bands import rows as rows_module
from worker.images.bands.rearrange import views_rows
from worker.images.bands.rows import open_rows
from worker.images.bands.scratch import ScratchRows, scratch_rows
from worker.images.write import write_code_rows, write_exr, write_exr_rows


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("rows")


def codes(rows: int = 50, cols: int = 40, bits: int = 8) -> np.ndarray:
    return np.random.default_rng(3).integers(0, 2**bits, (rows, cols, 3)).astype(f"u{bits // 8}")


def write_codes(path: Path, pixels: np.ndarray, bands: list[np.ndarray] | None = None) -> None:
    write_code_rows(path, bands or [pixels], size=pixels.shape[:2], bits=8 * pixels.itemsize)


def cut(pixels: np.ndarray, edges: set[int]) -> list[np.ndarray]:
    return np.split(pixels, sorted(edges))


@given(edges=st.sets(st.integers(1, 49)))
def test_bands_make_the_same_master_as_the_whole(folder: Path, edges: set[int]) -> None:
    light = noise(50, 40)
    write_exr(folder / "whole.exr", light, attributes={"rig": "{}"})
    write_exr_rows(folder / "bands.exr", cut(light, edges), size=(50, 40), attributes={"rig": "{}"})
    assert (folder / "bands.exr").read_bytes() == (folder / "whole.exr").read_bytes()


@pytest.mark.parametrize("bits", [8, 16])
def test_codes_come_back_as_others_read_them(bits: int, tmp_path: Path) -> None:
    pixels = codes(bits=bits)
    for suffix in (".png", ".tif"):
        write_codes(tmp_path / f"a{suffix}", pixels, cut(pixels, {7, 8, 31}))
    np.testing.assert_array_equal(read_tiff(tmp_path / "a.tif"), pixels)
    np.testing.assert_array_equal(decoded(tmp_path / "a.png", "rgb24" if bits == 8 else "rgb48le"), pixels)


@pytest.mark.parametrize("name", ["a.exr", "a8.tif", "a16.tif"])
def test_rows_can_be_had_in_any_order(name: str, tmp_path: Path) -> None:
    path = tmp_path / name
    pixels = noise(50, 40) if path.suffix == ".exr" else codes(bits=16 if "16" in name else 8)
    if path.suffix == ".exr":
        write_exr(path, pixels, attributes={})
    else:
        write_codes(path, pixels)
    with open_rows(path) as picture:
        assert (picture.rows, picture.cols, picture.dtype) == (50, 40, pixels.dtype)
        for start, stop in [(0, 3), (20, 50), (3, 20), (0, 50), (49, 50), (5, 6)]:
            found = picture.read(start, stop)
            assert found.dtype == pixels.dtype
            np.testing.assert_array_equal(found, pixels[start:stop])


@pytest.mark.parametrize(
    ("suffix", "tile_px", "origin"), [(".exr", 16, 0), (".tif", 16, 0), (".exr", 16, -7), (".exr", 0, 9)]
)
def test_pictures_of_other_programs_in_tiles_or_with_another_origin_are_read(
    suffix: str, tile_px: int, origin: int, tmp_path: Path
) -> None:
    pixels, path = noise(50, 40, np.float32), tmp_path / f"tiled{suffix}"
    target = ImageOutput.create(str(path))
    assert target is not None
    spec = ImageSpec(40, 50, 3, "float")
    spec.tile_width = spec.tile_height = tile_px
    spec.x = spec.y = origin
    spec.attribute("oiio:ColorSpace", "lin_rec709_scene")
    assert target.open(str(path), spec)
    assert target.write_image(pixels)
    assert target.close()
    with open_rows(path) as picture:
        for start, stop in [(0, 1), (15, 17), (40, 50), (0, 50)]:
            np.testing.assert_array_equal(picture.read(start, stop), pixels[start:stop])


def test_rows_that_are_not_there_are_refused(tmp_path: Path) -> None:
    write_exr(tmp_path / "a.exr", noise(5, 4), attributes={})
    with open_rows(tmp_path / "a.exr") as picture:
        for start, stop in [(-1, 2), (2, 2), (0, 6)]:
            with pytest.raises(ArtifactBroken, match=r"a\.exr: expected rows within 5"):
                picture.read(start, stop)
    with pytest.raises(ArtifactMissing), open_rows(tmp_path / "none.exr"):
        pass


def test_a_picture_cut_short_is_broken_at_the_rows_that_miss(tmp_path: Path) -> None:
    for name, pixels in {"a.exr": noise(50, 40), "a.png": codes(), "a.tif": codes()}.items():
        path = tmp_path / name
        if path.suffix == ".exr":
            write_exr(path, pixels, attributes={})
        else:
            write_codes(path, pixels)
        whole = path.read_bytes()
        path.write_bytes(whole[: len(whole) * 9 // 10])
        with pytest.raises(ArtifactBroken, match=name), open_rows(path) as picture:
            picture.read(40, 50)


def test_what_is_not_the_rows_of_the_size_leaves_nothing(tmp_path: Path) -> None:
    path = tmp_path / "a.exr"
    for bands, said in (
        ([noise(3, 4)], "expected 5 rows for a.exr, got 3"),
        ([noise(3, 4), noise(3, 4)], "at most 2 more rows of 4 px"),
        ([noise(5, 5)], "5 more rows of 4 px"),
    ):
        with pytest.raises(OutputError, match=said):
            write_exr_rows(path, bands, size=(5, 4), attributes={})
        assert not path.exists()


def test_what_fails_on_the_way_leaves_nothing(tmp_path: Path) -> None:
    def failing() -> Iterator[np.ndarray]:
        yield noise(3, 4)
        raise ArtifactBroken("cut short")

    with pytest.raises(ArtifactBroken, match="cut short"):
        write_exr_rows(tmp_path / "a.exr", failing(), size=(5, 4), attributes={})
    assert not [*tmp_path.iterdir()]


@pytest.mark.parametrize("lattice", ["square", "hexagonal"])
def test_views_kept_aside_are_the_grid_of_views(
    lattice: Lattice, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    layout = CellLayout(7, 5, 8, lattice)
    sheet = noise(layout.rows, layout.cols)
    for band_px in (1, 3 * layout.cols * layout.row_px, 10**6):
        monkeypatch.setattr(views_module, "BAND_PX", band_px)
        monkeypatch.setattr(rows_module, "BAND_BYTES", 6 * band_px)
        made = [*views_rows(SheetOfRows(HeldRows(sheet), layout), tmp_path)]
        assert (len(made) == 1) == (band_px == 10**6)
        np.testing.assert_array_equal(np.concatenate(made), views_grid(sheet, layout))
    assert not [*tmp_path.iterdir()]


def test_views_are_kept_aside_band_by_band(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    layout, taken, written = CellLayout(40, 3, 4), [0], [0]

    class Counted(SheetOfRows):
        def part(self, first: int, stop: int) -> np.ndarray:
            taken[0] += stop - first
            # One band is held before there is a place for it.
            assert taken[0] - written[0] <= 2
            return super().part(first, stop)

    class Counting(ScratchRows):
        def write(self, start: int, pixels: np.ndarray) -> None:
            written[0] += len(pixels) if start < layout.lens_rows else 0
            super().write(start, pixels)

    monkeypatch.setattr("worker.images.bands.scratch.ScratchRows", Counting)
    monkeypatch.setattr(views_module, "BAND_PX", 1)
    sheet = noise(layout.rows, layout.cols)
    made = [*views_rows(Counted(HeldRows(sheet), layout), tmp_path)]
    np.testing.assert_array_equal(np.concatenate(made), views_grid(sheet, layout))
    assert taken == written == [layout.lens_rows]


def test_a_scratch_folder_that_is_not_there_is_said(tmp_path: Path) -> None:
    kept = scratch_rows(tmp_path / "none", rows=1, cols=1, channels=1, dtype=np.uint8)
    with pytest.raises(StoreUnavailable, match="No such file or directory"), kept:
        pass


def test_a_full_disk_is_said_when_pixels_are_kept_aside(monkeypatch: pytest.MonkeyPatch) -> None:
    with Path("/dev/full").open("r+b", buffering=0) as full:
        monkeypatch.setattr("worker.images.bands.scratch.TemporaryFile", lambda **_: full)
        room = scratch_rows(None, rows=5, cols=10, channels=3, dtype=np.float32)
        with pytest.raises(StoreFull, match="cannot keep pixels aside: No space left"), room as kept:
            kept.write(0, np.zeros((5, 10, 3), np.float32))
