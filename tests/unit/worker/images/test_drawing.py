"""PNG by bands, and shapes drawn on paper."""

from __future__ import annotations

import io
import zlib
from pathlib import Path
from tempfile import gettempdir
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as some
from numpy.typing import NDArray
from PIL import Image

from lippmann.errors import OutputError
from lippmann.plan.printing.shapes import Bar, Ring, Shape, TextLine, line
from tests.pictures import read_png_16
from tests.unit.worker.images.pictures import decoded
from worker.images.bands.png import deflated_rows, write_png_bands
from worker.images.bands.rearrange import turned_bands
from worker.images.density import Density
from worker.images.drawing import paper


def gradients(rows: int, cols: int, bits: int) -> NDArray[Any]:
    """Return noise, a slope across and a slope down, so that every filter of a PNG is the best somewhere."""
    codes = np.random.default_rng(rows).integers(0, 2**bits, (rows, cols, 3))
    codes[rows // 3 :] = np.arange(cols)[:, np.newaxis] * 251
    codes[2 * rows // 3 :] = np.arange(rows - 2 * rows // 3)[:, np.newaxis, np.newaxis] * 7 + np.arange(3)
    wrapped: NDArray[Any] = (codes % 2**bits).astype(f"uint{bits}")
    return wrapped


@given(cuts=some.lists(some.integers(1, 60), max_size=5), cols=some.integers(1, 30))
def test_a_png_of_any_bands_holds_the_codes(cuts: list[int], cols: int) -> None:
    codes, file = gradients(40, cols, 8), io.BytesIO()
    bands = np.split(codes, sorted(set(cuts) & set(range(1, 40))))
    write_png_bands(file, bands, rows=40, cols=cols, bits=8)
    with Image.open(file) as picture:
        picture.verify()
    with Image.open(file) as picture:
        np.testing.assert_array_equal(np.asarray(picture), codes)


def test_a_png_of_16_bits_holds_the_codes_for_two_other_readers(tmp_path: Path) -> None:
    codes, path = gradients(50, 33, 16), tmp_path / "a.png"
    with path.open("wb") as file:
        write_png_bands(file, [codes[:20], codes[20:]], rows=50, cols=33, bits=16, density=Density(600, 25.4 / 0.042))
    np.testing.assert_array_equal(read_png_16(path), codes)
    np.testing.assert_array_equal(decoded(path, "rgb48le"), codes)
    with Image.open(path) as picture:
        assert picture.info["dpi"] == pytest.approx((23622 * 0.0254, 23810 * 0.0254))
        assert picture.info["srgb"] == 0


def test_all_three_filters_are_used() -> None:
    packed = b"".join(deflated_rows([gradients(60, 20, 8)], rows=60, cols=20, bits=8))
    filters = np.frombuffer(zlib.decompress(packed), np.uint8).reshape(60, 61)[:, 0]
    assert set(filters) == {1, 2, 4}


@pytest.mark.parametrize(("rows", "cols", "bits"), [(5, 4, 8), (3, 4, 8), (4, 5, 8), (4, 4, 16)])
def test_bands_of_another_picture_are_refused(rows: int, cols: int, bits: int) -> None:
    with pytest.raises(OutputError, match="expected"):
        write_png_bands(io.BytesIO(), [np.zeros((4, 4, 3), np.uint8)], rows=rows, cols=cols, bits=bits)


@given(rows=some.integers(1, 30), cols=some.integers(1, 600), cut=some.integers(1, 29), quarters=some.integers(0, 3))
def test_bands_are_turned_as_a_picture_is(rows: int, cols: int, cut: int, quarters: int) -> None:
    codes = np.random.default_rng(cols).integers(0, 2**16, (rows, cols, 3)).astype(np.uint16)
    bands = [part for part in (codes[:cut], codes[cut:]) if len(part)]
    asked = {"rows": rows, "cols": cols, "quarters": quarters, "bits": 16, "folder": Path(gettempdir())}
    turned = np.concatenate(list(turned_bands(bands, **asked)))  # type: ignore[arg-type]  # by name
    np.testing.assert_array_equal(turned, np.rot90(codes, -quarters))


BARS = some.builds(Bar, some.floats(-3, 12), some.floats(-3, 12), some.floats(0.01, 8), some.floats(0.01, 8))


@given(bar=BARS, pixel_mm=some.sampled_from([0.1, 0.37, 1.0]))
def test_a_bar_has_as_much_ink_as_it_covers_of_the_paper(bar: Bar, pixel_mm: float) -> None:
    rows, cols = round(10 / pixel_mm), round(9 / pixel_mm)
    ink = 1 - paper([bar], pixel_mm=pixel_mm, top=0, rows=rows, cols=cols)
    sides = []
    for count, start, stop in ((cols, bar.left_mm, bar.right_mm), (rows, bar.top_mm, bar.bottom_mm)):
        # Up to every edge between pixels, as much is inked as lies before it.
        edges = np.arange(count + 1) * pixel_mm
        sides.append(np.clip(np.minimum(edges, stop) - max(start, 0.0), 0.0, None))
    inked = np.cumsum(np.cumsum(ink, axis=0, dtype=float), axis=1) * pixel_mm**2
    np.testing.assert_allclose(inked, np.outer(sides[1][1:], sides[0][1:]), atol=1e-4)


def test_a_ring_has_the_ink_of_its_line_about_its_middle() -> None:
    ink = 1 - paper([Ring(5.03, 4.91, 2.0, 0.3)], pixel_mm=0.05, top=0, rows=200, cols=200)
    assert ink.sum() * 0.05**2 == pytest.approx(2 * np.pi * 2.0 * 0.3, rel=0.01)
    for axis, middle_mm in ((0, 5.03), (1, 4.91)):
        line_of_ink = ink.sum(axis=axis)
        assert (line_of_ink * (np.arange(200) + 0.5)).sum() / line_of_ink.sum() * 0.05 == pytest.approx(
            middle_mm, abs=0.005
        )


@given(cut=some.integers(1, 99))
def test_a_page_drawn_in_two_parts_is_the_page(cut: int) -> None:
    shapes: list[Shape] = [
        line(0.5, 5, 9, 5, line_mm=0.13),
        line(3, 0.2, 3, 9.7, line_mm=0.13),
        Ring(5, 5, 2, 0.2),
        TextLine(1, 4.5, 2.0, "print at 100 %"),
        TextLine(5, 9.9, 1.5, "jgpq", centred=True),
        TextLine(-1, 0.5, 1.5, "beyond the edges of the page"),
    ]
    whole = paper(shapes, pixel_mm=0.1, top=0, rows=100, cols=100)
    parts = [paper(shapes, pixel_mm=0.1, top=top, rows=rows, cols=100) for top, rows in ((0, cut), (cut, 100 - cut))]
    np.testing.assert_allclose(np.concatenate(parts), whole, atol=1e-5)
    assert whole.min() >= 0
    assert whole.max() == 1
    assert (whole[30:45, 10:] < 0.5).any()
