"""Every example on the page of the include library renders in plain POV-Ray and shows something."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.integration.povray.sdl import render_text
from tests.repository import DOCS

SECTIONS = re.split(r"^##+ ", (DOCS / "sdl-library.md").read_text(), flags=re.MULTILINE)
BLOCK = re.compile(r"^```pov\n(.*?)^```$", re.MULTILINE | re.DOTALL)
MACROS = {section[1 : section.index("(")]: section for section in SECTIONS if section.startswith("`")}


@cache
def preamble() -> str:
    """Return the first example of the page, to which all others are added."""
    block = BLOCK.search((DOCS / "sdl-library.md").read_text())
    assert block
    return block[1]


@pytest.fixture(scope="module")
def empty(tmp_path_factory: pytest.TempPathFactory) -> NDArray[np.float32]:
    """Return the picture of the preamble alone."""
    return render_text(preamble(), tmp_path_factory.mktemp("empty"))[0]


@pytest.mark.parametrize("macro", MACROS)
def test_the_example_of_a_macro_uses_it_and_changes_the_picture(
    macro: str, empty: NDArray[np.float32], tmp_path: Path
) -> None:
    (example,) = BLOCK.findall(MACROS[macro])
    assert f"{macro}(" in example
    # A mesh camera has rays for a picture of one size, which the example names.
    options = re.findall(r"\+(?:W|H|SR|ER)\d+", MACROS[macro])
    picture, _ = render_text(preamble() + example, tmp_path, more=options)
    assert picture.shape != empty.shape or np.abs(picture - empty).mean() > 0.01
    assert picture.max() > 0.05
