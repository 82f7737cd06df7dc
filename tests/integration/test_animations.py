"""Animations that were not made for Lippmann: the variables that POV-Ray gives their frames, and files they write."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from lippmann.job.animation.clock import Clock
from tests.builders import small_job
from worker.engines.povray.command import RenderCommand, povray_argv
from worker.images.read import read_rgb
from worker.sandbox.bundle import pack_folder
from worker.settings import WorkerSettings
from worker.tasks.local import CapturedFrame, capture_frame

NAMES = ("clock", "clock_delta", "final_clock", "final_frame", "frame_number", "initial_clock", "initial_frame")
SAID = "".join(f'#debug concat("{name}=", str({name}, 0, 5), "\\n")\n' for name in NAMES)


def said_values(folder: Path, options: list[str]) -> dict[str, float]:
    """Return the variables that a scene reads in a run of POV-Ray, by their names."""
    (folder / "said.pov").write_text('#version 3.7; #debug "\\n"' + SAID + "camera { location -5 * z }\n")
    ran = subprocess.run(
        ["povray", "+Isaid.pov", "-F", "+W8", "+H8", "-D", "-P", *options],
        cwd=folder, check=True, capture_output=True, text=True, timeout=60,
    )  # fmt: skip
    return {name: float(value) for name, value in re.findall(r"(\w+)=(-?\d+\.\d{5})", ran.stderr)}


@pytest.mark.parametrize(
    ("clock", "options"),
    [
        (Clock(first=0.5, last=2.0, frames=5), ["+KI0.5", "+KF2", "+KFI1", "+KFF5"]),
        (Clock(last=1.0, frames=5, cyclic=True), ["+KI0", "+KF1", "+KFI1", "+KFF5", "+KC"]),
    ],
    ids=["plain", "cyclic"],
)
def test_a_frame_has_the_variables_that_povray_gives_it(tmp_path: Path, clock: Clock, options: list[str]) -> None:
    command = RenderCommand("said.pov", "said.png", cols=8, rows=8, clock=clock.at(3), declares=clock.variables(3))
    ours = [word for word in povray_argv(command) if word.startswith(("+K", "Declare="))]
    expected = said_values(tmp_path, [*options, "+SF3", "+EF3"])
    assert set(expected) == set(NAMES)
    assert said_values(tmp_path, ours) == expected


STEPS = """#version 3.7; global_settings { assumed_gamma 1 } background { rgb frame_number / final_frame }
#fopen State "state.txt" write
#write (State, frame_number)
#fclose State
"""


def captured(folder: Path, text: str, *, frame: int, toml: str = "") -> tuple[NDArray[np.float64], CapturedFrame]:
    """Return the sheet of a captured frame of a scene in millimetres, linear, and all of its capture."""
    scene = folder / "bundle"
    scene.mkdir(exist_ok=True)
    (scene / "scene.pov").write_text(text)
    (scene / "scene.toml").write_text(
        'file = "scene.pov"\n[stage]\nlocation = [0, 0, -1000]\nlook_at = [0, 0, 0]\nnear_mm = 1000\nfar_mm = 2000\n'
        + toml
    )
    made = capture_frame(
        small_job("own", count=(6, 6), px_per_lens=4, capture={"method": "ray_camera"}),
        pack_folder(scene),
        frame=frame,
        out=folder / "out",
        on_progress=lambda what, done: None,
        settings=WorkerSettings(data_dir=folder / "data", slots=1, worker_name="test"),
    )
    (picture,) = (path for path in made.pictures if path.suffix == ".exr" and "orthoscopic" in str(path))
    return read_rgb(picture, np.float16).astype(np.float64), made


def test_a_frame_knows_its_number_and_a_scene_that_writes_files_is_noted(tmp_path: Path) -> None:
    pixels, made = captured(tmp_path, STEPS, frame=3, toml="[clock]\nframes = 4\n")
    assert pixels == pytest.approx(0.75, abs=0.001)
    (note,) = (note for note in made.notes if "writes files" in note)
    assert "(in scene.pov)" in note
