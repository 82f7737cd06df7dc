"""PNG files that POV-Ray itself writes with different file gammas, read as the light that was rendered."""

from __future__ import annotations

import subprocess
from pathlib import Path

import numpy as np
import pytest

from worker.images.foreign.colour_space import file_colour_space
from worker.untrusted import read_imported


@pytest.mark.parametrize(
    ("gamma", "name"), [("1.0", "linear"), ("2.2", "gamma 2.2"), ("1.8", "gamma 1.8"), ("sRGB", "sRGB")]
)
def test_a_png_of_any_file_gamma_is_read_as_the_rendered_light(tmp_path: Path, gamma: str, name: str) -> None:
    scene = tmp_path / "half.pov"
    scene.write_text("#version 3.7; global_settings { assumed_gamma 1 } background { rgb 0.5 }\n")
    picture = tmp_path / "half.png"
    command = ["povray", f"+I{scene}", f"+O{picture}", "+FN16", f"File_Gamma={gamma}", "+W8", "+H8", "-D"]
    subprocess.run(command, cwd=tmp_path, check=True, capture_output=True, timeout=120)
    assert file_colour_space(picture).name == name
    np.testing.assert_allclose(read_imported(picture), 0.5, atol=1e-4)
