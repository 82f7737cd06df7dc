"""The include files as a library: every one has an example that plain POV-Ray renders, and a place in the docs."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from povtemplates.catalogue import INCLUDE_FOLDER
from tests.repository import DOCS
from worker.engines.povray.command import SYSTEM_INCLUDE
from worker.images.read import read_rgb

EXAMPLES = sorted((INCLUDE_FOLDER / "examples").glob("*.pov"))
INCLUDES = sorted((INCLUDE_FOLDER / "lippmann").glob("*.inc"))
PAGE = (DOCS / "sdl-library.md").read_text()

MADE_BY_LIPPMANN = {"ray_camera"}
"""Needs rays that a person does not write by hand."""


def command_of(example: Path) -> list[str]:
    """Return the command line that the example itself says."""
    (line,) = re.findall(r"^//   (povray .*)$", example.read_text(), re.MULTILINE)
    return str(line).split()


def rendered_by_hand(example: Path, folder: Path) -> tuple[NDArray[np.float32], str]:
    """Return the picture that the example's own command gives, linear, and what POV-Ray said."""
    picture = folder / "picture.exr"
    ended = subprocess.run(
        [*command_of(example), "-D", "+FE", f"+O{picture}", f"+L{SYSTEM_INCLUDE}"],
        cwd=example.parent,
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert ended.returncode == 0, ended.stderr
    return read_rgb(picture, np.float32), ended.stderr


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda example: example.stem)
def test_an_example_renders_by_its_own_command_without_a_warning(example: Path, tmp_path: Path) -> None:
    picture, said = rendered_by_hand(example, tmp_path)
    assert not re.findall(r"(?:Parse |Render )?Warning:.*", said)
    assert picture.std(axis=(0, 1)).max() > 0.1, "something is to be seen"
    assert picture.mean() > 0.1, "and it is not dark"


def test_every_include_file_has_an_example() -> None:
    assert {example.stem for example in EXAMPLES} == {include.stem for include in INCLUDES} - MADE_BY_LIPPMANN


def test_the_example_of_a_capture_is_an_integral_image_of_its_scene(tmp_path: Path) -> None:
    """Neighbouring cells are alike, and turned by 180 degrees each: the ball's picture is upside down."""
    picture, _ = rendered_by_hand(INCLUDE_FOLDER / "examples" / "capture.pov", tmp_path)
    assert picture.shape == (240, 240, 3)
    centre = picture[3::8, 3::8]
    orange = (centre[..., 0] > 2 * centre[..., 2]) & (centre[..., 0] > 0.1)
    assert 0.2 < orange.mean() < 0.8
    sheet_rows, _ = np.nonzero(orange)
    assert sheet_rows.mean() > 14.5, "the ball lies above the axis, its image below"


def test_the_array_of_the_example_shows_the_letter_144_times_turned(tmp_path: Path) -> None:
    picture, _ = rendered_by_hand(INCLUDE_FOLDER / "examples" / "lens_array.pov", tmp_path)
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


def test_the_examples_stand_alone(tmp_path: Path) -> None:
    """Copied elsewhere they work with nothing but the folder of the include files."""
    example = shutil.copy(INCLUDE_FOLDER / "examples" / "glass.pov", tmp_path)
    shutil.copytree(INCLUDE_FOLDER / "lippmann", tmp_path / "lippmann")
    picture, _ = rendered_by_hand(Path(example), tmp_path)
    assert picture.shape == (240, 320, 3)


@pytest.mark.parametrize("include", INCLUDES, ids=lambda include: include.stem)
def test_every_macro_and_its_arguments_are_in_the_docs(include: Path) -> None:
    assert f"lippmann/{include.name}" in PAGE
    for name, arguments in re.findall(r"^#macro (\w+)\(([^)]*)\)", include.read_text(), re.MULTILINE):
        assert f"`{name}({arguments})`" in PAGE


def test_the_library_says_nothing_of_versions() -> None:
    """What a scene says of its #version is in effect where its parsing ends: an include must not change it."""
    for include in INCLUDES:
        assert "#version" not in include.read_text(), include.name
