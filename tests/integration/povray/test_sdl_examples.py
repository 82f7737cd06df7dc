"""Every include file of the library has an example, which plain POV-Ray renders by the example's own command."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.integration.povray.sdl import EXAMPLES, INCLUDES, LIBRARY, run_povray
from worker.images.read import read_rgb

EXPERIMENTAL = "This rendering uses the following experimental feature(s): mesh camera"
"""POV-Ray prints this warning for every ray camera."""


def command_of(example: Path) -> list[str]:
    """Return the command line that stands in the example's header."""
    (line,) = re.findall(r"^//   (povray .*)$", example.read_text(), re.MULTILINE)
    return str(line).split()


def render_example(example: Path, folder: Path) -> tuple[NDArray[np.float32], str]:
    """Render an example by its own command; return its picture in linear light and POV-Ray's messages."""
    picture = folder / "picture.exr"
    result = run_povray(example.parent, [*command_of(example), "+FE", f"+O{picture}"])
    assert result.returncode == 0, result.stderr[-2000:]
    return read_rgb(picture, np.float32), result.stderr


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda example: example.stem)
def test_an_example_renders_by_its_own_command_without_a_warning(example: Path, tmp_path: Path) -> None:
    picture, messages = render_example(example, tmp_path)
    warnings = re.findall(r"Warning: *(.*(?:\n .*)*)", messages)
    assert not [warning for warning in warnings if EXPERIMENTAL not in " ".join(warning.split())]
    assert picture.std(axis=(0, 1)).max() > 0.1, "something is to be seen"
    assert picture.mean() > 0.1, "and it is not dark"


def test_every_include_file_has_an_example() -> None:
    assert {example.stem for example in EXAMPLES} == {include.stem for include in INCLUDES}


def test_the_example_of_a_capture_is_an_integral_image_of_its_scene(tmp_path: Path) -> None:
    """Neighbouring cells are alike, and turned by 180 degrees each: the ball's picture is upside down."""
    picture, _ = render_example(LIBRARY / "examples" / "capture.pov", tmp_path)
    assert picture.shape == (240, 240, 3)
    centre = picture[3::8, 3::8]
    orange = (centre[..., 0] > 2 * centre[..., 2]) & (centre[..., 0] > 0.1)
    assert 0.2 < orange.mean() < 0.8
    sheet_rows, _ = np.nonzero(orange)
    assert sheet_rows.mean() > 14.5, "the ball lies above the axis, its image below"


def test_the_array_of_the_example_shows_the_letter_144_times_turned(tmp_path: Path) -> None:
    picture, _ = render_example(LIBRARY / "examples" / "lens_array.pov", tmp_path)
    blue = picture[..., 0] < 0.5
    side = 320 / 12.5
    first = (320 - 12 * side) / 2
    cells = np.array(
        [
            [
                blue[int(first + row * side) + 2 : int(first + row * side) + 24, :][
                    :, int(first + col * side) + 2 : int(first + col * side) + 24
                ]
                for col in range(2, 10)
            ]
            for row in range(2, 10)
        ]
    )
    assert (cells.mean(axis=(2, 3)) > 0.1).all()
    letter = cells.mean(axis=(0, 1))
    assert letter[:, 11:].sum() > 1.5 * letter[:, :11].sum(), "the stem is on the right"
    assert letter[11:].sum() > 1.05 * letter[:11].sum(), "the long arm is below"


def test_every_ray_of_the_ray_cameras_example_passes_through_the_centre_of_its_lens(tmp_path: Path) -> None:
    """The pixels that see the ball are those whose rays meet it by the geometry of the example."""
    picture, _ = render_example(LIBRARY / "examples" / "ray_camera.pov", tmp_path)
    assert picture.shape == (241, 240, 3)
    lenses, pixels, focal_mm = 30, 8, 3.3
    place = (np.arange(lenses * pixels) + 0.5) / pixels - lenses / 2
    centre = np.floor(place) + 0.5
    # The rig is at <0, 20, -60> and looks along +z: x and y of the rig are those of the scene.
    start = np.stack([*np.meshgrid(centre, -centre), np.zeros((240, 240))], axis=-1) + np.array([0.0, 20.0, -60.0])
    direction = np.stack([*np.meshgrid(centre - place, place - centre), np.full((240, 240), focal_mm)], axis=-1)
    direction /= np.linalg.norm(direction, axis=-1, keepdims=True)
    to_ball = np.array([3.0, 22.0, 0.0]) - start
    miss_mm = np.linalg.norm(to_ball - (to_ball * direction).sum(axis=-1, keepdims=True) * direction, axis=-1)
    # The dark side of the ball is not counted. The colour of the lit side differs from that of everything else.
    seen = picture[1:]
    orange = (seen[..., 0] > 2 * seen[..., 2]) & (seen[..., 1] < 0.8 * seen[..., 0])
    lit = orange & (seen[..., 0] > 0.02)
    assert (miss_mm[lit] < 8.01).all()
    assert lit[miss_mm < 7.9].mean() > 0.6
    assert 0.1 < lit.mean() < 0.9


def test_the_examples_stand_alone(tmp_path: Path) -> None:
    """Copied elsewhere they work with nothing but the folder of the include files."""
    example = shutil.copy(LIBRARY / "examples" / "glass.pov", tmp_path)
    shutil.copytree(LIBRARY, tmp_path / "lippmann")
    picture, _ = render_example(Path(example), tmp_path)
    assert picture.shape == (240, 320, 3)
