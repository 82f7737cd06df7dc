"""The cameras of scenes that were not made for Lippmann: POV-Ray reports them, and the rig goes and reads as they do.

Each camera is of a kind that public animations have, and its path is known by arithmetic of its own.
"""

from __future__ import annotations

import math
import subprocess
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from lippmann.job.scenes.scene_camera import SceneCamera
from lippmann.job.spec import JobSpec
from lippmann.lightfield.views.views import view
from lippmann.plan.sampling import frame_size
from tests.builders import local_place, small_job
from worker.images.read import read_rgb
from worker.sandbox.bundle import pack_folder
from worker.sandbox.log import AttemptLog
from worker.settings import WorkerSettings
from worker.tasks.attempts.monitor import NullMonitor
from worker.tasks.local import CapturedFrame, capture_frame, local_job
from worker.tasks.scenes.scene_camera import read_scene_camera
from worker.tasks.scenes.scene_notes import MOVES, examine_scene

Vector = tuple[float, float, float]

IN_THE_WAY = """global_settings { assumed_gamma 1.8 max_trace_level 2 radiosity { count 10 } photons { spacing 1 } }
fog { distance 4 rgb 1 } media { absorption 0.2 } sky_sphere { pigment { gradient y } }
plane { y, -1 pigment { checker } } sphere { 0, 1e5 hollow pigment { rgb 1 } } light_source { <10, 20, -30> 1 }
#default { finish { ambient 1 } } box { -0.5, 0.5 pigment { rgb <1, 0, 0> } }
"""
"""What a report must see through."""


@dataclass(frozen=True)
class Habit:
    """A camera and where it is at a clock."""

    text: str
    location: Callable[[float], Vector]
    ahead: Callable[[float], Vector]
    """The direction in which it looks, of any length."""
    handedness: str = "left"
    angle_deg: float | None = None
    head: str = "#version 3.7;"


def turned(vector: Vector, clock: float) -> Vector:
    """Return a vector after a turn by `clock` about y, as POV-Ray turns it: left-handed."""
    cos, sin = math.cos(2 * math.pi * clock), math.sin(2 * math.pi * clock)
    x, y, z = vector
    return x * cos + z * sin, y, z * cos - x * sin


def toward(target: Vector, location: Callable[[float], Vector]) -> Callable[[float], Vector]:
    def ahead(clock: float) -> Vector:
        x, y, z = (b - a for a, b in zip(location(clock), target, strict=True))
        return x, y, z

    return ahead


ORBIT = Habit(
    """camera { location <0, 3, -8> right x * image_width / image_height angle 40 look_at <0, 1, 0>
        rotate 360 * clock * y }""",
    lambda clock: turned((0, 3, -8), clock),
    lambda clock: turned((0, -2, 8), clock),
    angle_deg=40,
)
HABITS: dict[str, Habit] = {
    "orbit": ORBIT,
    "spline, focal blur and a bumpy lens": Habit(
        """#declare Path = spline { linear_spline 0, <0, 1, -9> 0.5, <6, 2, -3> 1, <2, 8, 4> }
        #declare Here = Path(clock);
        camera { location Here look_at <0, 0.5, 0> aperture 0.4 blur_samples 9 focal_point 0 normal { bumps 1 } }""",
        lambda clock: (
            float(np.interp(clock, [0, 0.5, 1], [0, 6, 2])),
            float(np.interp(clock, [0, 0.5, 1], [1, 2, 8])),
            float(np.interp(clock, [0, 0.5, 1], [-9, -3, 4])),
        ),
        lambda clock: toward((0, 0.5, 0), HABITS["spline, focal blur and a bumpy lens"].location)(clock),
    ),
    "scaled right vector, without a version": Habit(
        "camera { location <1, 2, -30> direction 1.5 * z right 3 * x up 2.25 * y scale 2 translate 5 * clock * x }",
        lambda clock: (2 + 5 * clock, 4, -60),
        lambda _: (0, 0, 1),
        angle_deg=90,
        head="",
    ),
    "vectors with z upward, as CAD programs write": Habit(
        """camera { location <120 - 40 * clock, -300, 80> direction <0, 1, 0> up <0, 0, 1> right <1.33, 0, 0> }""",
        lambda clock: (120 - 40 * clock, -300, 80),
        lambda _: (0, 1, 0),
        "right",
    ),
    "right-handed by right -x": Habit(
        "camera { location <7 * cos(clock), 7 * sin(clock), 3> sky z right -x * 4/3 look_at 0 }",
        lambda clock: (7 * math.cos(clock), 7 * math.sin(clock), 3),
        lambda clock: (-7 * math.cos(clock), -7 * math.sin(clock), -3),
        "right",
    ),
    "right-handed by a scale, orthographic, version 3.1": Habit(
        "camera { orthographic location <3, 1 + clock, -5> look_at <3, 1 + clock, 0> scale <-1, 1, 1> }",
        lambda clock: (-3, 1 + clock, -5),
        lambda _: (0, 0, 1),
        "right",
        head="#version 3.1;",
    ),
    "far from the origin, fisheye": Habit(
        "camera { fisheye angle 160 location <4e7, 0, -3e7> look_at <0, 0, -3e7> }",
        lambda _: (4e7, 0, -3e7),
        lambda _: (-1, 0, 0),
    ),
}


def bundle(
    folder: Path, text: str, *, toml: str = "", location: str = "[0, 0, -1000]", mm_per_unit: float = 1
) -> bytes:
    """Return the bundle of a scene."""
    scene = folder / "bundle"
    scene.mkdir(exist_ok=True)
    (scene / "scene.pov").write_text(text)
    (scene / "scene.toml").write_text(
        f'file = "scene.pov"\n[stage]\nlocation = {location}\nlook_at = [0, 0, 0]\nmm_per_unit = {mm_per_unit}\n'
        f"near_mm = 1000\nfar_mm = 2000\n{toml}"
    )
    return pack_folder(scene)


def reported(folder: Path, text: str, clock: float) -> SceneCamera:
    """Return the camera that POV-Ray reports of a scene."""
    place = local_place(folder / "data")
    job = small_job("own", frames="1", clock={"first": clock})
    sheet = local_job(place, job, bundle(folder, text))
    with place.task_folder() as task, AttemptLog(folder / "log.txt") as log:
        camera = read_scene_camera(place, sheet, 1, folder=task, log=log, monitor=NullMonitor())
    assert camera is not None
    return camera


@pytest.mark.parametrize("name", HABITS)
def test_povray_reports_the_camera_of_a_scene_whatever_stands_in_its_way(tmp_path: Path, name: str) -> None:
    habit, clock = HABITS[name], 0.3
    camera = reported(tmp_path, f"{habit.head}\n{IN_THE_WAY}{habit.text}", clock)
    expected = np.array(habit.location(clock))
    assert np.array(camera.location) == pytest.approx(expected, abs=1e-6 * (10 + np.abs(expected).max()))
    ahead = np.array(habit.ahead(clock))
    assert np.array(camera.axes()[2]) == pytest.approx(ahead / np.linalg.norm(ahead), abs=2e-5)
    assert camera.handedness == habit.handedness
    if habit.angle_deg:
        assert camera.angle_deg == pytest.approx(habit.angle_deg, abs=0.01)


ROOM = """#version 3.7; global_settings { assumed_gamma 1 } background { rgb 0 }
#declare Code = pigment { average pigment_map {
  [1 function { 0.5 + x / 44 } color_map { [0 rgb 0] [1 rgb <3, 0, 0>] }]
  [1 function { 0.5 + y / 44 } color_map { [0 rgb 0] [1 rgb <0, 3, 0>] }]
  [1 function { 0.5 + z / 44 } color_map { [0 rgb 0] [1 rgb <0, 0, 3>] }] } }
box { -20, 20 hollow pigment { Code } finish { ambient 0 diffuse 0 emission 1 } }
"""
"""A room whose walls have their places as colours."""
ROOM_HALF, ROOM_SPAN = 20.0, 44.0


def captured(folder: Path, data: bytes, job: JobSpec, *, frame: int = 1) -> tuple[NDArray[np.float64], CapturedFrame]:
    """Return the orthoscopic sheet of a captured frame, linear, and all of its capture."""
    made = capture_frame(
        job,
        data,
        frame=frame,
        out=folder / "out",
        on_progress=lambda what, done: None,
        settings=WorkerSettings(data_dir=folder / "data", slots=1, worker_name="test"),
    )
    (picture,) = (path for path in made.pictures if path.suffix == ".exr" and "orthoscopic" in str(path))
    return read_rgb(picture, np.float16).astype(np.float64), made


def wall_ahead(location: Vector, ahead: Vector) -> NDArray[np.float64]:
    """Return the point of the room that a ray meets."""
    start, way = np.array(location), np.array(ahead) / np.linalg.norm(ahead)
    with np.errstate(divide="ignore"):
        reach = (np.sign(way) * ROOM_HALF - start) / way
    point: NDArray[np.float64] = start + way * reach[np.isfinite(reach)].min()
    return point


@pytest.mark.parametrize(("name", "frame"), [("orbit", 2), ("right-handed by right -x", 3)])
def test_a_rig_that_follows_looks_at_what_the_camera_looks_at(tmp_path: Path, name: str, frame: int) -> None:
    """The rig of frame 1 stands where the camera does, and the clock goes on by 0.3 a frame."""
    habit, clock = HABITS[name], 0.3 * (frame - 1)
    location, ahead = np.array(habit.location(0)), np.array(habit.ahead(0))
    toml = "follow_camera = true\n[clock]\nper_frame = 0.3\n"
    toml = toml if "sky z" not in habit.text else f"up = [0, 0, 1]\n{toml}"
    data = bundle(tmp_path, ROOM + habit.text, toml=toml, location=str(location.tolist()), mm_per_unit=100)
    (tmp_path / "bundle" / "scene.toml").write_text(
        (tmp_path / "bundle" / "scene.toml").read_text().replace("[0, 0, 0]", str((location + ahead).tolist()))
    )
    data = pack_folder(tmp_path / "bundle")
    sheet, _ = captured(
        tmp_path, data, small_job("own", count=(6, 6), px_per_lens=4, capture={"method": "ray_camera"}), frame=frame
    )
    seen = (sheet[8:16, 8:16].mean(axis=(0, 1)) - 0.5) * ROOM_SPAN
    assert seen == pytest.approx(wall_ahead(habit.location(clock), habit.ahead(clock)), abs=0.1)


LETTER = """#version 3.7; global_settings { assumed_gamma 1 } background { rgb 0.05 }
union { box { <-2, -3, 0>, <-1, 3, 0.1> } box { <-2, 2, 0>, <2, 3, 0.1> } box { <-2, -0.5, 0>, <1, 0.5, 0.1> }
  pigment { rgb 1 } finish { ambient 0 diffuse 0 emission 1 } scale 7 FLIP }
CAMERA
"""
"""The letter F, as text looks upright to the scene's own camera."""
MIRRORED = {
    "right -x": ("scale <-1, 1, 1>", "camera { location -400 * z right -x angle 7.63 look_at 0 }"),
    "z upward": (
        "rotate 90 * x",
        "camera { location <0, -400, 0> direction 7.5 * y up z right x }",
    ),
}


@pytest.mark.parametrize(
    ("name", "method"), [("right -x", "glass"), ("right -x", "ray_camera"), ("z upward", "ray_camera")]
)
def test_text_that_the_camera_of_a_right_handed_scene_shows_is_readable(tmp_path: Path, name: str, method: str) -> None:
    flip, camera = MIRRORED[name]
    text = LETTER.replace("FLIP", flip).replace("CAMERA", camera)
    up, location = ("[0, 0, 1]", "[0, -400, 0]") if name == "z upward" else ("[0, 1, 0]", "[0, 0, -400]")
    data = bundle(tmp_path, text, location=location, mm_per_unit=2.5, toml=f"up = {up}\n")
    job = small_job("own", count=(40, 40), px_per_lens=3, capture={"method": method})
    sheet, made = captured(tmp_path, data, job)
    found = view(sheet, frame_size(job.rig), 1, 1).mean(axis=-1)
    own = own_picture(tmp_path, text)
    likeness = {
        flip: float(np.corrcoef(picture.ravel(), own.ravel())[0, 1])
        for flip, picture in (("upright", found), ("mirrored", found[:, ::-1]), ("upside down", found[::-1]))
    }
    assert likeness["upright"] > 0.7
    assert likeness["upright"] > 0.2 + max(likeness["mirrored"], likeness["upside down"])
    assert any("mirror-imaged" in note for note in made.notes)


def own_picture(folder: Path, text: str) -> NDArray[np.float64]:
    """Return what the scene's own camera shows in plain POV-Ray, 40 x 40 px."""
    (folder / "own.pov").write_text(text)
    subprocess.run(
        ["povray", "+Iown.pov", "+Oown.exr", "+FE", "+W40", "+H40", "-D", "-A"],
        cwd=folder, check=True, capture_output=True, timeout=60,
    )  # fmt: skip
    light: NDArray[np.float64] = read_rgb(folder / "own.exr", np.float32).astype(np.float64).mean(axis=-1)
    return light


def test_a_camera_that_moves_without_the_rig_is_noted(tmp_path: Path) -> None:
    data = bundle(
        tmp_path, ROOM + ORBIT.text, toml="[clock]\nlast = 1.0\nframes = 9\ncyclic = true\n", location="[0, 3, -8]"
    )
    place = local_place(tmp_path / "data")
    job = small_job("own", count=(4, 4), px_per_lens=2, frames="1-9")
    sheet = local_job(place, job, data)
    with place.task_folder() as task, AttemptLog(tmp_path / "log.txt") as log:
        found = examine_scene(place, sheet, folder=task, log=log, monitor=NullMonitor())
    assert found.notes == (MOVES,)
    assert found.camera is None
