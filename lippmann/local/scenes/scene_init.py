"""Write the scene.toml of an own scene from the scene's own camera, by the rule of docs/own-scenes.md.

`model_init` does the same for a model in glTF, `splat_init` for Gaussian splats.
"""

from __future__ import annotations

import json
import math
import tempfile
from dataclasses import dataclass
from pathlib import Path

from lippmann.errors import BadInput, LippmannError
from lippmann.job.scenes.scene import parse_scene
from lippmann.job.scenes.scene_camera import SceneCamera
from lippmann.job.spec import parse_spec
from lippmann.local.scenes.animation_ini import AnimationIni, animation_ini
from lippmann.local.scenes.model_init import MODEL_SUFFIXES, model_text
from lippmann.local.scenes.splat_init import splat_text
from lippmann.untrusted.toml_text import read_toml
from povtemplates.catalogue import MANIFEST
from worker.engines.mitsuba.inside.scenes.splat_file import is_splats
from worker.engines.povray.scenes.scene_variables import SceneVariables, scene_variables
from worker.engines.povray.version import check_povray
from worker.sandbox.bundle import pack_folder
from worker.sandbox.log import AttemptLog
from worker.settings import WorkerSettings
from worker.tasks.attempts.monitor import NullMonitor
from worker.tasks.attempts.workplace import workplace
from worker.tasks.local import local_job
from worker.tasks.scenes.own_view import OwnView, own_view
from worker.tasks.scenes.scene_camera import read_scene_camera

RIG_TANGENT = 0.15
"""The tangent of half the angle of view of a rig with 90 x 90 lenses of 1 mm."""
NEAR_MM = 1000.0
"""The distance from which the lens of the paper works."""
RIG_LENGTH_MM = 600.0
"""The length of a rig of glass behind surface 1."""
_NEAREST = 0.8
"""The share of the way to the nearest objects by which a rig may be nearer than an orthographic camera."""
DEEPEST = 10.0
"""The largest ratio of the far depth to the near one that is written; a horizon is farther."""
_MOVING_FRAMES = 9
"""The frames of the clock from 0 to 1 among which the camera is searched for movement."""
_LOOK = (1, 4, _MOVING_FRAMES)

_PLACEHOLDER = "[stage]\nlocation = [0, 0, -1]\nlook_at = [0, 0, 0]\nnear_mm = 1\nfar_mm = 1\n"


@dataclass(frozen=True)
class DraftScene:
    """A scene.toml that was written."""

    file: Path
    text: str
    notes: tuple[str, ...]


@dataclass(frozen=True)
class PlacedRig:
    """The stage of a rig that sees what a camera sees."""

    location: tuple[float, float, float]
    look_at: tuple[float, float, float]
    factor: float
    """The factor by which the rig is farther from the middle of the scene than the camera."""
    mm_per_unit: float
    far_mm: float
    free: float | None
    """The units behind the rig's surface 1 that are missing to an object in the way of the rig; None if none is."""


def init_scene(file: Path) -> DraftScene:
    """Write a scene.toml beside a scene.

    Raises
    ------
    BadInput
        If there is no such scene, there is a scene.toml already, or the scene shows no camera or no objects.
    LippmannError
        Whatever the scene fails with, or that POV-Ray is missing.
    """
    holds_splats = file.is_file() and file.suffix.lower() == ".ply" and is_splats(file)
    if not file.is_file() or not (holds_splats or file.suffix.lower() in (".pov", ".inc", *MODEL_SUFFIXES)):
        raise BadInput(f"expected a .pov, .inc, .glb or .gltf file or a .ply of splats, got {file}")
    _check_name(file.name)
    target = file.parent / MANIFEST
    if target.exists():
        raise BadInput(f"expected a folder without {MANIFEST}, got {target}; remove or rename it to write a new one")
    if file.suffix.lower() in MODEL_SUFFIXES:
        text, notes = model_text(file, tangent=RIG_TANGENT, near_mm=NEAR_MM, deepest=DEEPEST)
    elif holds_splats:
        text, notes = splat_text(file, tangent=RIG_TANGENT, near_mm=NEAR_MM, deepest=DEEPEST)
    else:
        text, notes = _pov_text(file)
    try:
        parse_scene(read_toml(text.encode(), field=MANIFEST))
    except LippmannError as error:
        raise BadInput(f"expected a scene of a size that a rig can have, got {file.name}: {error.message}") from error
    try:
        target.write_text(text, encoding="utf-8")
    except OSError as error:
        raise BadInput(f"expected a folder that can be written to, got {file.parent}: {error.strerror}") from error
    return DraftScene(file=target, text=text, notes=notes)


def _pov_text(file: Path) -> tuple[str, tuple[str, ...]]:
    """Return the scene.toml of a scene of POV-Ray, and notes."""
    settings = WorkerSettings()
    check_povray(settings.povray)
    ini = animation_ini(file)
    camera, view, moves, variables = _examined(file, settings, ini)
    is_animated = variables.clock or variables.frames
    text = _manifest_text(file.name, camera, view, moves=moves, is_animated=is_animated, ini=ini)
    return text, (*_notes(camera, view, moves=moves), *(ini.notes if ini else ()))


def _check_name(name: str) -> None:
    try:
        parse_scene(read_toml(f'file = "{name}"\n{_PLACEHOLDER}'.encode(), field=MANIFEST))
    except (LippmannError, UnicodeEncodeError) as error:
        raise BadInput(
            f"expected a file with a name of printable letters, without quotation marks and backslashes, got {name!a}"
        ) from error


def _examined(
    file: Path, settings: WorkerSettings, ini: AnimationIni | None
) -> tuple[SceneCamera, OwnView, bool, SceneVariables]:
    with tempfile.TemporaryDirectory(prefix="lippmann-init-") as scratch:
        include = f"include = {json.dumps(ini.include)}\n" if ini and ini.include else ""
        data = pack_folder(file.parent, manifest=f'file = "{file.name}"\n{include}{_PLACEHOLDER}'.encode())
        place = workplace(settings.model_copy(update={"data_dir": Path(scratch) / "data"}), own_files=True)
        clock = {"last": 1.0} | dict(ini.clock if ini else {}) | {"frames": _MOVING_FRAMES}
        spec = parse_spec({"scene": "scene", "frames": f"1-{_MOVING_FRAMES}", "clock": clock})
        sheet = local_job(place, spec, data)
        with place.bundle(sheet.bundle) as unpacked:
            variables = scene_variables(unpacked)
        with place.task_folder() as folder, AttemptLog(folder.with_suffix(".txt")) as log:
            frames = _LOOK if variables.clock or variables.frames else _LOOK[:1]
            cameras = [
                read_scene_camera(place, sheet, frame, folder=folder, log=log, monitor=NullMonitor())
                for frame in frames
            ]
            camera = cameras[0]
            if camera is None:
                raise BadInput(f"expected a scene with a camera, got none in {file.name}")
            view = own_view(place, sheet, camera, folder=folder, log=log)
            if view is None:
                raise BadInput(f"expected a camera that sees objects, got one that sees none, in {file.name}")
        moves = any(other is not None and not other.is_at(camera) for other in cameras)
        return camera, view, moves, variables


def _placed_rig(camera: SceneCamera, view: OwnView) -> PlacedRig:
    """Return the stage of a rig that sees what a camera sees, from farther away.

    The camera sees half of its picture's width at tan(a / 2) of the distance and the rig at `RIG_TANGENT`, so the rig
    is farther from the middle of the scene by their ratio. An orthographic camera sees the same width everywhere.
    """
    if view.width is None:
        back = (max(1.0, math.tan(math.radians(camera.angle_deg) / 2) / RIG_TANGENT) - 1.0) * view.middle
    else:
        back = max(view.width / 2 / RIG_TANGENT - view.middle, -_NEAREST * view.near)
    mm_per_unit = _rounded(NEAR_MM / (view.near + back))
    location = _along(camera, -back, view.middle)
    look_at = _along(camera, view.middle, view.middle)
    far = min(view.far + back, DEEPEST * (view.near + back))
    missing = None if view.behind is None else back + RIG_LENGTH_MM / mm_per_unit - view.behind
    return PlacedRig(
        location=location,
        look_at=look_at,
        factor=back / view.middle + 1.0,
        mm_per_unit=mm_per_unit,
        far_mm=max(NEAR_MM, math.ceil(far * mm_per_unit / 50) * 50.0),
        free=missing if missing is not None and missing > 0 else None,
    )


def _along(camera: SceneCamera, way: float, middle: float) -> tuple[float, float, float]:
    """Return the point on the axis of a camera at a distance from it."""
    pairs = zip(camera.location, camera.axes()[2], strict=True)
    x, y, z = (_rounded(start + way * share, middle=middle) for start, share in pairs)
    return x, y, z


def _manifest_text(
    name: str, camera: SceneCamera, view: OwnView, *, moves: bool, is_animated: bool, ini: AnimationIni | None
) -> str:
    """Return the text of a scene.toml with its reasons as comments."""
    rig, own = _placed_rig(camera, view), _along(camera, 0.0, view.middle)
    seen = f"{camera.angle_deg:.3g} degrees" if view.width is None else f"a width of {view.width:.3g} by parallel rays"
    lines = [
        f'file = "{name}"',
        *([f"include = {json.dumps(ini.include)}   # Library_Path of {ini.name}"] if ini and ini.include else []),
        "",
        "[stage]",
        f"# The camera of the scene is at {_vector(own)} and sees {seen}.",
        f"# The rig sees 17 degrees, so it is {rig.factor:.3g} times as far from the middle of what the camera sees.",
        f"location = {_vector(rig.location)}",
        f"look_at = {_vector(rig.look_at)}",
        f"up = {_vector(_up(camera))}",
        "# The nearest objects are to be 1000 mm from the rig.",
        f"mm_per_unit = {rig.mm_per_unit:.6g}",
        f"near_mm = {NEAR_MM:g}.0",
        f"far_mm = {rig.far_mm:.1f}",
    ]
    if rig.free is not None:
        lines += [
            f"# CHECK: an object {view.behind:.4g} units behind the camera is in the way of the rig, which shows white",
            "# or that object. Move location nearer to look_at, or turn the line of sight.",
        ]
    if camera.handedness == "right":
        lines.append("# The camera is mirror-imaged, as in scenes with right-handed axes, and so is the rig.")
    if moves:
        lines += ["# The camera moves with the clock, and the rig moves with it:", "follow_camera = true"]
    if is_animated or (ini and ini.clock):
        lines += _clock_lines(ini)
    return "\n".join(lines) + "\n"


_CLOCK_OPTIONS = {
    "first": "Initial_Clock",
    "last": "Final_Clock",
    "frames": "Final_Frame",
    "cyclic": "Cyclic_Animation",
}


def _clock_lines(ini: AnimationIni | None) -> list[str]:
    """Return the lines of the table `clock`: that of an .ini, or one to fill in."""
    clock = dict(ini.clock) if ini and ini.clock else {"first": 0.0, "last": 1.0, "frames": 30, "cyclic": False}
    source = f"{ini.name} has these options" if ini and ini.clock else "These are the options of the animation's .ini"
    frames = f'. A job of all frames has "frames": "1-{clock["frames"]}"' if "frames" in clock else ""
    lines = ["", f"# {source}{frames}.", "[clock]"]
    return lines + [f"{f'{name} = {json.dumps(value)}':<34}# {_CLOCK_OPTIONS[name]}" for name, value in clock.items()]


def _notes(camera: SceneCamera, view: OwnView, *, moves: bool) -> list[str]:
    rig = _placed_rig(camera, view)
    notes = []
    if rig.free is not None:
        notes.append(f"an object {view.behind:.4g} units behind the camera is in the way of the rig; see the comment")
    if camera.handedness == "right":
        notes.append("the camera is mirror-imaged, as in scenes with right-handed axes, and so is the rig")
    if moves:
        notes.append("the camera moves with the clock, and follow_camera moves the rig with it")
    return notes


def _up(camera: SceneCamera) -> tuple[float, float, float]:
    """Return the axis of the scene that is upward in the picture, or else the camera's own direction."""
    right, up, _ = camera.axes()
    for index in (1, 2, 0):
        if abs(right[index]) < 1e-4 and up[index] > 0.1:
            return (float(index == 0), float(index == 1), float(index == 2))
    return up


def _vector(vector: tuple[float, float, float]) -> str:
    return f"[{', '.join(repr(round(float(share), 6) + 0.0) for share in vector)}]"


def _rounded(number: float, *, middle: float = 0.0) -> float:
    """Return a number of four digits, or one that differs by less than a ten-thousandth of `middle`."""
    size = max(abs(number), middle)
    return 0.0 if size == 0 else round(number, 3 - math.floor(math.log10(size)))
