"""Scenes that were not made for Lippmann: POV-Ray's own examples, unmodified, by a scene.toml that places the rig.

What POV-Ray shows of the same files by a pinhole at the entrance pupil is the oracle for the centre view.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from lippmann.errors import LippmannError
from lippmann.job.scenes.scene import parse_scene
from lippmann.job.spec import JobSpec
from lippmann.lightfield.views.views import view
from lippmann.plan.sampling import frame_size
from tests.builders import small_job
from tests.needs import missing
from tests.repository import DOCS
from worker.engines.povray.command import SYSTEM_INCLUDE
from worker.images.colour import srgb_codes
from worker.images.read import read_rgb
from worker.sandbox.bundle import pack_folder
from worker.settings import WorkerSettings
from worker.tasks.local import capture_frame

EXAMPLES = Path("/usr/share/doc/povray/examples")
"""Of Debian's povray-examples."""

TUTORIAL = DOCS / "own-scenes.md"

LENSES = 40
ENTRANCE_PUPIL_MM = 56.56
"""Of the paper's lens, behind its surface 1 as seen from the scene."""
ANGLE_DEG = 7.63
"""What 40 lenses of 1 mm see: 90 see 17.04 degrees (povtemplates/scenes/fish/preview.pov)."""

Picture = NDArray[np.float64]
Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Example:
    """An example of POV-Ray's, and where the rig stands in it: far enough that its 7.6 degrees see something."""

    scene: str
    location: Vector
    look_at: Vector
    mm_per_unit: float
    near_mm: float
    far_mm: float
    files: Sequence[str] = ()
    """What the scene uses of its own folder."""
    up: Vector = (0, 1, 0)
    per_frame: float = 1.0
    """Of the clock."""
    alike: float = 0.8
    """Correlation with the pinhole at least; the microlenses blur, and see 1/3 of a lens a pixel."""


EXAMPLES_TRIED = {
    "woods and a camera of its own": Example("advanced/woodbox.pov", (-25, 50, -75), (0, 0, 0), 12, 1000, 1300),
    "version 3.6, image map and include": Example(
        "advanced/drums2/drums.pov", (0, 3, -260), (12, 8, 0), 4, 950, 1200, files=("drums.inc", "rednewt.png")
    ),
    "height field from a picture": Example(
        "advanced/crater/crater.pov", (0, 12, -30), (0, 0, 0), 40, 1000, 1700, files=("crater_dat.png",)
    ),
    "animation with fonts": Example(
        "animations/clockd/clockd.pov", (0, 1, -36), (0, 2, 0), 30, 1000, 1400, per_frame=0.125
    ),
    "photons in version 3.6": Example("lights/phot_met_glass.pov", (40, 10, 20), (0, -1, 0), 25, 950, 1400),
    "radiosity": Example("radiosity/radiosity3.pov", (19, 36, -50), (0, 0.6, 0), 18, 1000, 1300),
    "media and an image map": Example("interior/media/media3.pov", (0, 9, -30), (0, -0.5, 0), 35, 1000, 1200),
}


def present(example: Example) -> Path:
    """Return the example's file; skip at home and fail in CI without it."""
    scene = EXAMPLES / example.scene
    if not scene.is_file():
        missing(f"povray-examples is not installed: no {scene}")
    return scene


def bundle_of(example: Example, folder: Path) -> bytes:
    """Return the bundle of the example: its files as they are, and a scene.toml of seven lines."""
    scene = present(example)
    folder.mkdir()
    for name in (scene.name, *example.files):
        shutil.copyfile(scene.parent / name, folder / name)
    (folder / "scene.toml").write_text(
        f'file = "{scene.name}"\n[stage]\nlocation = {list(example.location)}\nlook_at = {list(example.look_at)}\n'
        f"mm_per_unit = {example.mm_per_unit}\nnear_mm = {example.near_mm}\nfar_mm = {example.far_mm}\n"
        f"up = {list(example.up)}\n[clock]\nper_frame = {example.per_frame}\n"
    )
    return pack_folder(folder)


def job(method: str = "auto") -> JobSpec:
    return small_job("own", count=(LENSES, LENSES), px_per_lens=3, capture={"method": method})


def centre_view(example: Example, folder: Path, *, frame: int = 1, method: str = "auto") -> Picture:
    """Return the centre view of a captured frame, linear `(row, col, channel)`."""
    folder.mkdir(exist_ok=True)
    captured = capture_frame(
        job(method),
        bundle_of(example, folder / "bundle"),
        frame=frame,
        out=folder / "out",
        on_progress=lambda what, done: None,
        settings=WorkerSettings(data_dir=folder / "data", slots=2, worker_name="test"),
    )
    (picture,) = (path for path in captured.pictures if path.suffix == ".exr" and "orthoscopic" in str(path))
    return view(read_rgb(picture, np.float16).astype(np.float64), frame_size(job().rig), 1, 1)


def pinhole_picture(example: Example, folder: Path) -> Picture:
    """Return what plain POV-Ray shows of the example from the entrance pupil, linear `(row, col, channel)`."""
    scene = present(example)
    ahead = np.subtract(example.look_at, example.location)
    pupil = example.location - ahead / np.linalg.norm(ahead) * ENTRANCE_PUPIL_MM / example.mm_per_unit
    camera = {"location": pupil, "sky": example.up}
    head = "".join(f"{word} <{', '.join(map(str, values))}> " for word, values in camera.items())
    look_at = f"<{', '.join(map(str, example.look_at))}>"
    pov, picture = folder / "pinhole.pov", folder / "pinhole.exr"
    # POV-Ray takes angle and look_at by what was said before them.
    pov.write_text(
        f'#include "{scene.name}"\n'
        f"camera {{ perspective {head} direction z right x up y angle {ANGLE_DEG} look_at {look_at} }}\n"
    )
    size = (f"+W{LENSES}", f"+H{LENSES}")
    subprocess.run(
        ["povray", f"+I{pov}", f"+O{picture}", "+FE", *size, "-D", "-A", "+K0", f"+L{SYSTEM_INCLUDE}"],
        cwd=scene.parent,
        check=True,
        capture_output=True,
        timeout=300,
    )
    return read_rgb(picture, np.float32).astype(np.float64)


def luminance(linear: Picture) -> Picture:
    return np.clip(linear, 0, 1) @ [0.2126, 0.7152, 0.0722]


def likenesses(found: Picture, expected: Picture) -> Mapping[str, float]:
    """Return the correlations of a picture and its flips with another."""
    flips = {"upright": found, "mirrored": found[:, ::-1], "upside down": found[::-1], "turned": found[::-1, ::-1]}
    return {name: float(np.corrcoef(flip.ravel(), expected.ravel())[0, 1]) for name, flip in flips.items()}


@pytest.mark.parametrize("name", EXAMPLES_TRIED)
def test_an_unmodified_example_shows_what_a_pinhole_at_the_same_place_does(tmp_path: Path, name: str) -> None:
    assert_shown(EXAMPLES_TRIED[name], tmp_path)


def test_the_scene_toml_of_the_tutorial_works_as_printed(tmp_path: Path) -> None:
    (printed,) = re.findall(r"```toml\n(file = .*?)```", TUTORIAL.read_text(), re.DOTALL)
    card = parse_scene(tomllib.loads(printed))
    stage = card.stage
    assert_shown(
        Example(f"advanced/{card.file}", stage.location, stage.look_at, stage.mm_per_unit, stage.near_mm, stage.far_mm),
        tmp_path,
    )


def assert_shown(example: Example, tmp_path: Path) -> None:
    """Compare the centre view with the pinhole's picture: place, sides and brightness."""
    found = luminance(centre_view(example, tmp_path))
    expected = luminance(pinhole_picture(example, tmp_path))
    alike = likenesses(found, expected)
    assert alike["upright"] > example.alike
    assert alike["upright"] > 0.05 + max(likeness for flip, likeness in alike.items() if flip != "upright")
    # Own assumed_gamma, #version and lights: as bright as by itself.
    assert found.mean() == pytest.approx(expected.mean(), rel=0.05)


def test_an_example_looks_the_same_by_glass_and_by_the_ray_camera(tmp_path: Path) -> None:
    example = EXAMPLES_TRIED["version 3.6, image map and include"]
    glass, rays = (centre_view(example, tmp_path / method, method=method) for method in ("glass", "ray_camera"))
    assert np.median(np.abs(glass - rays)) < 0.001
    assert np.corrcoef(glass.ravel(), rays.ravel())[0, 1] > 0.99


def test_the_clock_moves_an_unmodified_animation(tmp_path: Path) -> None:
    example = EXAMPLES_TRIED["animation with fonts"]
    first = centre_view(example, tmp_path / "1", frame=1)
    third = centre_view(example, tmp_path / "3", frame=3)
    changed = np.abs(third - first).max(axis=-1) > 0.05
    assert 0.01 < changed.mean() < 0.5, "the wheel's hand turns; floor and wall stay"


@pytest.mark.parametrize(
    "version", ["", "#version 3.0;", "#version 3.5;", "#version 3.7;"], ids=["none", "3.0", "3.5", "3.7"]
)
def test_what_a_scene_says_of_its_version_holds(tmp_path: Path, version: str) -> None:
    """Before 3.7 a scene without assumed_gamma is not linear: 0.5 is shown as 0.5, which is 0.214 in linear light."""
    by_itself = 0.5 if "3.7" in version else 0.214
    text = "background { rgb 0.5 }\ncamera { location 3 look_at 0 }\n"
    assert small_capture(tmp_path, version + text) == pytest.approx(by_itself, abs=0.002)


@pytest.mark.parametrize(
    "said",
    [
        "#default { normal { bumps 3 scale 0.1 } finish { reflection 1 ambient 1 } }",
        "#macro Row(A) A #end #macro Sag() 1 #end #declare Pitch = sphere { 0, 1 } #declare Right = 3;",
        "camera { fisheye angle 200 } camera { orthographic location 9 aperture 2 blur_samples 9 focal_point 0 }",
        "global_settings { max_trace_level 1 }",
        "#declare Last = 1; // no new line after this",
    ],
    ids=["defaults", "names", "cameras", "trace level", "end"],
)
def test_nothing_that_a_scene_says_reaches_the_rig(tmp_path: Path, said: str) -> None:
    text = "#version 3.7; global_settings { assumed_gamma 1 } background { rgb <0.5, 0.25, 1> }\n" + said
    assert small_capture(tmp_path, text) == pytest.approx(np.mean([0.5, 0.25, 1]), abs=0.001)


@pytest.mark.parametrize("file", ["frame.pov", "two words/scene with blanks.pov"])
def test_a_scene_may_have_any_name_and_includes_beside_it(tmp_path: Path, file: str) -> None:
    bundle = tmp_path / "bundle" / Path(file).parent
    bundle.mkdir(parents=True)
    (bundle / "colours.inc").write_text("#declare Grey = rgb 0.5;")
    text = '#version 3.7; #include "colours.inc"\nbackground { Grey }'
    assert small_capture(tmp_path, text, file=file) == pytest.approx(0.5, abs=0.001)


GREY = "#version 3.7; global_settings { assumed_gamma 1 } background { rgb 0.5 }\n"
TAKES_GREY = '#include "rays.inc"\nbackground { Grey }'
METHODS = pytest.mark.parametrize("method", ["glass", "ray_camera"])


@METHODS
@pytest.mark.parametrize("file", ["rays.inc", "lippmann/stage.inc", "lippmann.pov"])
def test_a_scene_may_be_named_as_a_file_of_the_rig_is(tmp_path: Path, file: str, method: str) -> None:
    assert small_capture(tmp_path, GREY, file=file, method=method) == pytest.approx(0.5, abs=0.001)


@METHODS
@pytest.mark.parametrize("file", ["scene.pov", "sub/scene.inc"])
def test_a_scene_includes_its_own_file_of_any_name_and_the_rig_its_own(tmp_path: Path, file: str, method: str) -> None:
    """The rig's includes of a bundle may be old copies, or broken: only the scene's own business."""
    beside = tmp_path / "bundle" / Path(file).parent
    (beside / "lippmann").mkdir(parents=True)
    (beside / "rays.inc").write_text("#declare Grey = rgb 0.5;")
    for name in ("stage.inc", "glass.inc", "capture.inc", "ray_camera.inc"):
        (beside / "lippmann" / name).write_text("#error")
    text = "#version 3.7; global_settings { assumed_gamma 1 }\n" + TAKES_GREY
    assert small_capture(tmp_path, text, file=file, method=method) == pytest.approx(0.5, abs=0.001)


@pytest.mark.parametrize(("method", "fog_mm"), [("glass", 1454), ("ray_camera", 1000)])
def test_fog_fills_a_rig_of_glass_and_ends_at_the_lens_of_the_ray_camera(
    tmp_path: Path, method: str, fog_mm: float
) -> None:
    """The camera stands 572 mm behind surface 1, 118 mm of them glass, and the black wall 1000 mm before it."""
    text = """#version 3.7; global_settings { assumed_gamma 1 } fog { distance 500 rgb 1 }
    plane { -z, 0 hollow pigment { rgb 0 } }"""
    seen = small_picture(tmp_path, text, method=method)
    assert seen.mean() == pytest.approx(1 - np.exp(-fog_mm / 500), abs=0.01)


@pytest.mark.parametrize(("method", "seen"), [("glass", 1.0), ("ray_camera", 0.5)])
def test_a_wall_behind_the_lens_hides_the_scene_from_glass_alone(tmp_path: Path, method: str, seen: float) -> None:
    text = """#version 3.7; global_settings { assumed_gamma 1 } background { rgb 0.5 }
    box { <-500, -500, -1500>, <500, 500, -1490> pigment { rgb 1 } finish { ambient 0 diffuse 0 emission 1 } }"""
    assert small_capture(tmp_path, text, method=method) == pytest.approx(seen, abs=0.001)


def small_capture(folder: Path, text: str, *, file: str = "scene.pov", method: str = "auto") -> float:
    """Return the mean of a captured scene; every pixel must be what every other is."""
    linear = small_picture(folder, text, file=file, method=method)
    assert (linear == linear[0, 0]).all()
    return float(linear.mean())


def small_picture(
    folder: Path, text: str, *, file: str = "scene.pov", method: str = "auto", parameters: str = ""
) -> NDArray[np.float64]:
    """Return the sheet of a captured scene in millimetres, linear."""
    scene = folder / "bundle" / file
    scene.parent.mkdir(parents=True, exist_ok=True)
    scene.write_text(text)
    (folder / "bundle" / "scene.toml").write_text(
        f'file = "{file}"\n[stage]\nlocation = [0, 0, -1000]\nlook_at = [0, 0, 0]\nnear_mm = 1000\nfar_mm = 2000\n'
        + parameters
    )
    captured = capture_frame(
        small_job("own", count=(6, 6), px_per_lens=4, capture={"method": method}),
        pack_folder(folder / "bundle"),
        frame=1,
        out=folder / "out",
        on_progress=lambda what, done: None,
        settings=WorkerSettings(data_dir=folder / "data", slots=1, worker_name="test"),
    )
    (picture,) = (path for path in captured.pictures if path.suffix == ".exr" and "orthoscopic" in str(path))
    return read_rgb(picture, np.float16).astype(np.float64)


TINT = '[parameters.tint]\ntype = "color"\ndefault = "#20a0ff"\n'
"""A colour with three different codes."""

TINTED = "#ifndef (tint) #declare tint = rgb 0; #end background { color tint }\n"


@METHODS
@pytest.mark.parametrize(
    ("file", "head"),
    [
        ("scene.inc", "global_settings { assumed_gamma 1.0 }"),
        ("scene.inc", ""),
        ("scene.pov", "#version 3.7;"),
        ("scene.pov", "#version 3.6; global_settings { assumed_gamma 1 }"),
    ],
    ids=["include", "include without gamma", "version 3.7 without gamma", "version 3.6"],
)
def test_a_colour_parameter_is_seen_as_its_srgb_codes(tmp_path: Path, file: str, head: str, method: str) -> None:
    seen = small_picture(tmp_path, head + "\n" + TINTED, file=file, method=method, parameters=TINT)
    np.testing.assert_array_equal(srgb_codes(seen), np.broadcast_to([0x20, 0xA0, 0xFF], seen.shape))


@pytest.mark.parametrize(
    ("head", "said"),
    [
        ("#version 3.7; global_settings { assumed_gamma 2.2 }", "parameter of type color needs assumed_gamma 1"),
        ("#version 3.6;", "before assumed_gamma has been set"),
    ],
    ids=["gamma 2.2", "version 3.6 without gamma"],
)
def test_a_colour_parameter_in_a_scene_that_is_not_linear_is_refused(tmp_path: Path, head: str, said: str) -> None:
    with pytest.raises(LippmannError, match=said):
        small_picture(tmp_path, head + "\n" + TINTED, parameters=TINT)
