"""Autofocus: textures at known depths are found on both lattices, and where there is nothing to find it is said."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from lippmann.lattice.cell import Lattice
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.image import IntegralImage
from lippmann.lightfield.refocus.autofocus import REFINED, find_focus, focus_measures, sharpest_depth
from lippmann.lightfield.refocus.shift_and_sum import focal_stack
from tests.unit.lippmann.lightfield.sheets import image_of
from tests.unit.lippmann.lightfield.textures import Texture, sheet_of_texture

FOCAL_MM = 3.3
ENDS_MM = (-40.0, 40.0)
MIDDLE = (3.5, 3.5)


def waves(x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
    noise = np.random.default_rng(3)
    light = np.full(x.shape, 0.5)
    for _ in range(40):
        along, down, phase = noise.uniform(-2, 2), noise.uniform(-2, 2), noise.uniform(0, 2 * np.pi)
        light += 0.05 * np.sin(along * x + down * y + phase)
    clipped: NDArray[np.float64] = np.clip(light, 0, 1)
    return clipped


def image_at(depth_mm: float, lattice: Lattice = "square", texture: Texture = waves) -> IntegralImage:
    layout = CellLayout(24, 24, 8, lattice)
    return image_of(sheet_of_texture(layout, texture, depth_mm, focal_mm=FOCAL_MM), layout, focal_length_mm=FOCAL_MM)


@pytest.mark.parametrize("lattice", ["square", "hexagonal"])
@pytest.mark.parametrize("depth_mm", [-21.3, 0.0, 30.0])
def test_a_plane_is_found_among_all_depths(depth_mm: float, lattice: Lattice) -> None:
    image = image_at(depth_mm, lattice)
    rows, cols = image.layout.square_size()
    for place in ((rows // 2, cols // 2), (rows // 3, cols // 4)):
        assert find_focus(image, place, MIDDLE, ENDS_MM) == pytest.approx(depth_mm, abs=0.5 * FOCAL_MM)


def test_the_contrast_is_that_of_the_refocused_picture() -> None:
    image, depths_mm = image_at(12.0), [0.0, 12.0, 20.0]
    tones = np.sqrt(focal_stack(image, depths_mm)[:, 6:15, 5:14])
    down, across = np.gradient(tones, axis=(1, 2))
    expected = (down**2 + across**2).sum(axis=-1).mean(axis=(1, 2))
    np.testing.assert_allclose(focus_measures(image, (10, 9), MIDDLE, depths_mm).contrast, expected, rtol=1e-3)


def test_a_place_is_meant_in_a_view_and_not_in_the_middle_of_all() -> None:
    def half(x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
        light: NDArray[np.float64] = np.where(x > 0, waves(x, y), 0.5)
        return light

    image = image_at(35.0, texture=half)
    # In the leftmost view the edge is 35 / (8 x 3.3) x 3.5 = 4.6 lenses further right, so that the patch is uniform.
    seen = {eye: focus_measures(image, (12, 13), eye, [35.0]).contrast[0] for eye in (MIDDLE, (0.0, 3.5))}
    assert seen[MIDDLE] > 3 * seen[0.0, 3.5]


def test_the_sharpest_depth_is_taken_close_to_a_known_one_and_not_beyond() -> None:
    image, depths_mm = image_at(20.0), np.arange(15.0, 25.0, 0.1)
    sharpest_mm = depths_mm[np.argmax(focus_measures(image, (12, 12), MIDDLE, depths_mm).contrast)]
    assert sharpest_mm == pytest.approx(20.0, abs=1.5)
    assert sharpest_depth(image, (12, 12), MIDDLE, 19.0) == pytest.approx(sharpest_mm, abs=0.2)
    assert REFINED * FOCAL_MM < 6
    assert sharpest_depth(image, (12, 12), MIDDLE, 14.0) == 14.0


def test_a_uniform_picture_has_no_depth_and_keeps_a_known_one() -> None:
    image = image_at(20.0, texture=lambda x, _: np.full(x.shape, 0.3))
    assert find_focus(image, (12, 12), MIDDLE, ENDS_MM) is None
    assert sharpest_depth(image, (12, 12), MIDDLE, 14.0) == 14.0


@pytest.mark.parametrize("place", [(0, 0), (23, 23), (0, 23)])
def test_at_the_border_the_part_of_the_patch_counts_that_exists(place: tuple[int, int]) -> None:
    assert find_focus(image_at(15.0), place, MIDDLE, ENDS_MM) == pytest.approx(15.0, abs=FOCAL_MM)
