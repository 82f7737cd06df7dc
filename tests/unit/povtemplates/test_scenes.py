"""The built-in scenes."""

from __future__ import annotations

import json
import math
import re
import struct
from pathlib import Path

import pytest

from lippmann.errors import BundleError
from lippmann.job.scenes.scene import SCENE_FILE, parse_scene
from lippmann.job.spec import JobSpec
from lippmann.optics.lens.matrices import cardinal_points
from lippmann.optics.lens.published import ATHINEOS_2006
from lippmann.optics.rig.check import check_rig
from lippmann.untrusted.toml_text import read_toml
from povtemplates.catalogue import MANIFEST, POSTER, scene_folders
from worker.sandbox.bundle import check_bundle, digest_of, pack_folder, unpack

MANIFESTS = {
    name: parse_scene(read_toml((folder / MANIFEST).read_bytes(), field=MANIFEST))
    for name, folder in scene_folders().items()
}
SCENES = {name: folder for name, folder in scene_folders().items() if MANIFESTS[name].engine == "povray"}
MESH_SCENES = {name: folder for name, folder in scene_folders().items() if MANIFESTS[name].engine == "mitsuba"}


def test_the_fish_and_the_targets_are_there() -> None:
    assert set(SCENES) >= {"fish", "target-position", "target-letter", "target-white", "target-points"}


@pytest.mark.parametrize("name", MANIFESTS)
def test_a_scene_has_a_poster(name: str) -> None:
    poster = (scene_folders()[name] / POSTER).read_bytes()
    width_px, height_px = struct.unpack(">II", poster[16:24])  # in the first chunk of a PNG
    assert width_px == height_px
    assert width_px >= 360


@pytest.mark.parametrize("name", SCENES)
def test_a_scene_is_a_right_bundle_for_the_papers_rig(name: str) -> None:
    card = check_bundle(pack_folder(SCENES[name])).card
    assert card.title
    assert card.license == "MIT"
    assert check_rig(JobSpec(scene=name), card.stage)


@pytest.mark.parametrize("name", SCENES)
def test_a_scene_declares_a_default_for_each_of_its_parameters(name: str) -> None:
    card = check_bundle(pack_folder(SCENES[name])).card
    text = (SCENES[name] / SCENE_FILE).read_text()
    assert all(f"#ifndef ({parameter})" in text for parameter in card.parameters)


@pytest.mark.parametrize("name", SCENES)
def test_the_pinhole_camera_of_a_scene_sees_what_the_papers_rig_captures(name: str) -> None:
    """It is at the front focal point of the imaging lens, and its angle of view is that of 90 lenses of 1 mm."""
    points = cardinal_points(ATHINEOS_2006)
    z_mm = -1000 - points.front_focal_distance_mm
    angle_deg = 2 * math.degrees(math.atan(45 / points.effective_focal_length_mm))
    text = "".join(path.read_text() for path in SCENES[name].iterdir() if path.suffix in {".inc", ".pov"})
    locations = re.findall(r"location (?:<0, \d+, )?(-[\d.]+)(?:\*z|>)", text)
    assert [float(z) for z in locations] == [round(z_mm, 2)]
    assert re.findall(r"angle ([\d.]+)", text) == [f"{angle_deg:.2f}"]


def test_the_fish_in_meshes_and_the_turning_knot_are_there() -> None:
    assert set(MESH_SCENES) >= {"fish-mesh", "turning-knot"}


@pytest.mark.parametrize("name", MESH_SCENES)
def test_a_scene_in_meshes_fits_the_papers_rig(name: str) -> None:
    card = MANIFESTS[name]
    assert card.title
    assert card.license == "MIT"
    assert check_rig(JobSpec(scene=name), card.stage)


@pytest.mark.parametrize("name", MESH_SCENES)
def test_a_scene_in_meshes_is_small(name: str) -> None:
    kept = sum(path.stat().st_size for path in MESH_SCENES[name].rglob("*") if path.name != POSTER)
    assert kept <= 1_500_000


def test_the_fish_in_meshes_has_the_stage_of_the_fish_in_right_handed_axes() -> None:
    ours, theirs = MANIFESTS["fish-mesh"], MANIFESTS["fish"]
    x, y, z = theirs.stage.location
    assert ours.stage == theirs.stage.model_copy(update={"location": (x, y, -z)})


def test_the_fish_in_meshes_declares_its_clock_and_parameters_with_their_defaults() -> None:
    card = MANIFESTS["fish-mesh"]
    text = (MESH_SCENES["fish-mesh"] / card.file).read_text()
    declared = {name: float(value) for name, value in re.findall(r'<default name="(\w+)" value="([^"]+)"/>', text)}
    assert declared == {"clock": 0.0} | {name: parameter.default for name, parameter in card.parameters.items()}
    assert all(f"${name}" in text for name in declared)


def test_the_fish_in_meshes_has_all_files_that_it_names_and_no_others() -> None:
    folder = MESH_SCENES["fish-mesh"]
    named = set(re.findall(r'name="filename" value="([^"]+)"', (folder / "scene.xml").read_text()))
    there = {path.relative_to(folder).as_posix() for path in folder.glob("*/*") if path.suffix in {".ply", ".png"}}
    assert named == there


def test_the_clock_of_the_knot_runs_through_its_animation_in_a_turn_of_the_fish() -> None:
    card = MANIFESTS["turning-knot"]
    data = (MESH_SCENES["turning-knot"] / card.file).read_bytes()
    length = int.from_bytes(data[12:16], "little")
    model = json.loads(data[20 : 20 + length])
    (animation,) = model["animations"]
    (end_s,) = model["accessors"][animation["samplers"][0]["input"]]["max"]
    assert end_s == pytest.approx(45 * card.clock.per_frame)


def test_packing_twice_gives_the_same_name() -> None:
    assert digest_of(pack_folder(SCENES["fish"])) == digest_of(pack_folder(SCENES["fish"]))


def test_unpacking_gives_back_every_file(tmp_path: Path) -> None:
    unpack(pack_folder(SCENES["fish"]), tmp_path)
    assert (tmp_path / "textures" / "skin.png").read_bytes() == (SCENES["fish"] / "textures" / "skin.png").read_bytes()
    assert pack_folder(tmp_path) == pack_folder(SCENES["fish"])


def test_a_bundle_without_scene_toml_is_refused_by_name(tmp_path: Path) -> None:
    (tmp_path / SCENE_FILE).write_text("sphere { 0, 1 }")
    with pytest.raises(BundleError, match=r"expected scene\.toml at the top of the bundle"):
        check_bundle(pack_folder(tmp_path))
