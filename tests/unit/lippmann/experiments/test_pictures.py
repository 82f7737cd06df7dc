"""Panels keep pixels, plots are written, and what is missing is said."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lippmann.errors import LippmannError
from lippmann.experiments.figures.lens_image import image_size, likeness
from lippmann.experiments.machine import Machine
from lippmann.experiments.panels import GAP_PX, Panel, cut, enlarged, fitted, write_panels
from lippmann.experiments.run import FIGURES, run_figure
from lippmann.local.studies import plot
from tests.pictures import read_png

MACHINE = Machine(cpu="Pentium 4", cores=1, povray="3.7", date="2006-10-01")


def noise(rows: int, cols: int) -> np.ndarray[tuple[int, ...], np.dtype[np.uint8]]:
    return np.random.default_rng(2).integers(0, 256, (rows, cols, 3), dtype=np.uint8)


def test_pictures_side_by_side_keep_every_pixel(tmp_path: Path) -> None:
    first, second, below = noise(100, 151), noise(60, 240), noise(33, 70)
    write_panels(tmp_path / "p.png", [[Panel(first, "a"), Panel(second, "b\nb")], [Panel(below, "c")]])
    page = read_png(tmp_path / "p.png")
    top, left = GAP_PX, GAP_PX
    assert (page[top : top + 100, left : left + 151] == first).all()
    left += 151 + GAP_PX
    assert (page[top : top + 60, left : left + 240] == second).all()
    assert page.shape[1] == left + 240 + GAP_PX
    starts = [row for row in range(page.shape[0] - 33) if (page[row : row + 33, GAP_PX : GAP_PX + 70] == below).all()]
    assert len(starts) == 1
    assert (page[starts[0] + 33 :] < 128).any(), "words under it"


def test_an_enlarged_pixel_is_a_square_of_its_colour() -> None:
    linear = np.array([[[0.0, 0.5, 1.0], [1.0, 0.0, 0.0]]])
    assert enlarged(linear, 3).shape == (3, 6, 3)
    assert (enlarged(linear, 3)[:, :3] == (0, 188, 255)).all()


def test_a_fitted_picture_has_the_longer_side_that_was_asked_for() -> None:
    assert fitted(np.zeros((50, 100, 3), dtype=np.float32), 40).shape == (20, 40, 3)


@pytest.mark.parametrize(("middle", "first"), [((5, 5), 3), ((0, 0), 0), ((9, 9), 6)])
def test_a_cut_lies_inside_the_picture(middle: tuple[int, int], first: int) -> None:
    picture = np.arange(10)[:, np.newaxis, np.newaxis] * np.ones((10, 10, 3))
    part = cut(picture, middle=middle, side_px=4)
    assert part.shape == (4, 4, 3)
    assert part[0, 0, 0] == first


def test_a_plot_says_what_was_measured_where(tmp_path: Path) -> None:
    files = (tmp_path / "p.png", tmp_path / "p.svg")
    with plot.axes(title="Title", x="threshold", y="time, s", note=str(MACHINE), files=files) as drawn:
        drawn.plot([1, 2], [3, 4], label="a line")
    page = read_png(files[0])
    assert min(page.shape[:2]) >= 600
    assert (page[0, 0] == 255).all(), "on white, whatever is behind it"
    assert files[1].read_text().startswith("<?xml")


def test_without_matplotlib_it_is_said_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(plot, "find_spec", lambda _: None)
    with pytest.raises(LippmannError, match=r"expected matplotlib.*got none.*lippmann\[plots\]"):
        run_figure("fig8", out=tmp_path, quick=True)


@pytest.mark.parametrize("name", FIGURES)
def test_every_figure_has_its_function(name: str) -> None:
    from importlib import import_module

    assert callable(getattr(import_module(f"lippmann.experiments.figures.{FIGURES[name]}"), name))


def test_size_and_distortion_of_an_image_are_read_off_its_places() -> None:
    """A barrel: the image of x is m x (1 - 0.04 (x / 176)^2), so the edge is 4 % too near to the axis."""
    seen = np.linspace(-176, 176, 201)
    window = -0.28 * seen * (1 - 0.04 * (seen / 176) ** 2)
    found = image_size(window, seen)
    assert found["magnification"] == pytest.approx(-0.28, rel=2e-3)
    assert found["distortion_at_the_edge"] == pytest.approx(-0.04, abs=2e-3)


def test_of_the_flips_of_a_picture_the_right_one_is_told() -> None:
    scene = noise(40, 50).astype(np.float32)
    assert likeness(scene, scene[::-1, ::-1])["orientation"] == "turned by 180 degrees"
    assert likeness(scene, scene)["orientation"] == "upright"
