"""The built-in scenes."""

from __future__ import annotations

import math
import re
from pathlib import Path

import pytest

from lippmann.errors import BundleError
from lippmann.job.scene import SCENE_FILE
from lippmann.job.spec import JobSpec
from lippmann.optics.lens.matrices import cardinal_points
from lippmann.optics.lens.published import ATHINEOS_2006
from lippmann.optics.rig.check import check_rig
from povtemplates.catalogue import scene_folders
from worker.sandbox.bundle import check_bundle, digest_of, pack_folder, unpack

SCENES = scene_folders()


def test_the_fish_and_the_targets_are_there() -> None:
    assert set(SCENES) >= {"fish", "target-position", "target-letter", "target-white", "target-points"}


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
