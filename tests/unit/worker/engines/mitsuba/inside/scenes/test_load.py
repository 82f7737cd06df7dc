"""The kind of a scene file chooses its loader, and no other loader is imported."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from tests.unit.worker.engines.mitsuba.inside.scenes.splat_text import write_splats


def test_a_ply_of_splats_is_no_mesh(load: Callable[..., Any], tmp_path: Path) -> None:
    file = write_splats(tmp_path / "b.ply", [[0, 0, 0]], [[1, 1, 1]], opacities=[0.5], colours=[[1, 0, 0]])
    (shape,) = load({"a.ply": file.read_bytes()}).scene.shapes()
    assert shape.is_ellipsoids()


def test_trimesh_is_imported_for_its_own_files_alone() -> None:
    """Its import takes longer than a frame."""
    modules = "from worker.engines.mitsuba.inside.scenes import gltf, load, xml"
    code = f"import sys; {modules}; sys.exit('trimesh' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
