"""Plain POV-Ray on text that includes the library, as a person runs it."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from povtemplates.catalogue import INCLUDE_FOLDER
from worker.engines.povray.command import SYSTEM_INCLUDE
from worker.images.read import read_rgb

LIBRARY = INCLUDE_FOLDER / "lippmann"
INCLUDES = sorted(LIBRARY.glob("*.inc"))
EXAMPLES = sorted((LIBRARY / "examples").glob("*.pov"))

STAND_IN = """
global_settings { assumed_gamma 1 max_trace_level 24 }
light_source { <-200, 400, -300>, 1 }
background { rgb <0.5, 0.7, 1> }
camera { location <0, 0, -200> look_at 0 }
"""
"""What a scene needs beside the thing that a test is about."""


def run_povray(folder: Path, command: Sequence[str]) -> subprocess.CompletedProcess[str]:
    """Run a command of POV-Ray in a folder and return its result, whatever its exit status."""
    return subprocess.run(
        [*command, "-D", f"+L{SYSTEM_INCLUDE}"], cwd=folder, capture_output=True, text=True, timeout=300, check=False
    )


def render_text(
    text: str, folder: Path, *, cols: int = 32, rows: int = 24, more: Sequence[str] = ()
) -> tuple[NDArray[np.float32], str]:
    """Render a scene with the library on the library path.

    Returns
    -------
    picture
        Linear light, float32, `(row, col, 3)`.
    messages
        The text that POV-Ray writes to its error stream.
    """
    (folder / "scene.pov").write_text(text)
    size = [f"+W{cols}", f"+H{rows}"]
    result = run_povray(folder, ["povray", "+Iscene.pov", f"+L{INCLUDE_FOLDER}", *size, "+FE", "+Opicture.exr", *more])
    assert result.returncode == 0, result.stderr[-2000:]
    return read_rgb(folder / "picture.exr", np.float32), result.stderr


def evaluate(folder: Path, before: str, *expressions: str) -> list[float]:
    """Return the values that POV-Ray computes for expressions, after it has parsed some text."""
    shown = "".join(f'#debug concat("VALUE ", str({expression}, 0, 12), "\\n")\n' for expression in expressions)
    _, messages = render_text(f"{before}\n{shown}{STAND_IN}", folder, cols=8, rows=8)
    return [float(value) for value in re.findall(r"VALUE (\S+)", messages)]
