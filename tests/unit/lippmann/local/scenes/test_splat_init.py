"""`lippmann scenes init` for Gaussian splats: the rig before the box of most of them."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest

from lippmann.errors import BadInput
from lippmann.job.scenes.scene import parse_scene
from lippmann.local.scenes.scene_init import RIG_TANGENT, init_scene
from tests.unit.worker.engines.mitsuba.inside.scenes.splat_text import write_splats


def test_the_box_leaves_floaters_and_faint_splats_out(tmp_path: Path) -> None:
    random = np.random.default_rng(1)
    solid = random.uniform([-1, 2, 3], [1, 4, 4], (5000, 3))
    floaters = random.uniform(-500, 500, (100, 3))
    faint = random.uniform(-90, 90, (3000, 3))
    centers = np.concatenate([solid, floaters, faint])
    file = write_splats(
        tmp_path / "place.ply",
        centers,
        np.full_like(centers, 0.1),
        opacities=np.where(np.arange(8100) < 5100, 0.9, 0.05),
        colours=np.full_like(centers, 0.5),
    )
    made = init_scene(file)
    scene = parse_scene(tomllib.loads(made.file.read_text()))
    stage = scene.stage
    assert (scene.file, scene.engine, stage.handedness, stage.up) == ("place.ply", "mitsuba", "right", (0, -1, 0))
    assert stage.look_at == pytest.approx((0, 3, 3.5), abs=0.1)
    # 90 % of what lies evenly in a width of 2 is in 1.8.
    near = 1.1 * 0.92 / RIG_TANGENT
    assert stage.location == pytest.approx((0, 3, 3.5 - 0.46 - near), abs=0.3)
    assert stage.mm_per_unit == pytest.approx(1000 / near, rel=0.05)
    assert (stage.near_mm, 1100 <= stage.far_mm <= 1200) == (1000, True)
    assert made.notes[0].startswith("CHECK location")


def test_damaged_splats_and_spz_are_refused_and_nothing_is_written(tmp_path: Path) -> None:
    file = tmp_path / "a.ply"
    file.write_bytes(b"ply\nformat binary_little_endian 1.0\nelement vertex 9\nproperty float f_dc_0\nend_header\n")
    with pytest.raises(BadInput, match=r"a\.ply: expected the properties of 3D Gaussian Splatting"):
        init_scene(file)
    (tmp_path / "a.spz").write_bytes(b"\x1f\x8b")
    with pytest.raises(BadInput, match=r"expected a .* or a \.ply of splats, got .*a\.spz"):
        init_scene(tmp_path / "a.spz")
    (tmp_path / "mesh.ply").write_bytes(b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n0\n")
    with pytest.raises(BadInput, match=r"expected a .* or a \.ply of splats, got .*mesh\.ply"):
        init_scene(tmp_path / "mesh.ply")
    assert not (tmp_path / "scene.toml").exists()
