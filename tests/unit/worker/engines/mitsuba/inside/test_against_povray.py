"""POV-Ray's ray camera and Mitsuba show the same meshes through the same rig."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.builders import local_place, rendered_codes, small_job
from tests.mesh_scenes import Light, povray_bundle, quad, torus, write_for_mitsuba
from tests.needs import needs_povray
from worker.engines.mitsuba.inside.messages import Request
from worker.tasks.local import local_job

LEAST_DB = 50.0

STAGE = "location = [0.0, 1.0, 100.0]\nlook_at = [0.0, 0.0, 0.0]\nmm_per_unit = 10.0\nnear_mm = 900.0\nfar_mm = 1300.0"
"""One unit is 1 cm, and the rig looks along -z, slightly downward."""

C, S = np.cos(0.7), np.sin(0.7)
TURN = np.array([[1, 0, 0], [0, C, -S], [0, S, C]])
MESHES = (
    quad((-60, -6, 60), (120, 0, 0), (0, 0, -110), (0.5, 0.55, 0.6)),
    quad((-60, -60, -25), (120, 0, 0), (0, 120, 0), (0.8, 0.7, 0.5)),
    torus(rings=24, sides=10, radius=3.5, tube=1.3, colour=(0.9, 0.3, 0.1), turn=TURN, at=(-1.5, 0.5, 2.0)),
    torus(rings=16, sides=8, radius=2.0, tube=0.8, colour=(0.1, 0.4, 0.9), turn=TURN.T, at=(4.0, 1.5, -9.0)),
)
"""A floor, a wall and two rings of 736 triangles, which cast shadows on all of them."""
LIGHTS = (Light((0.4, -0.7, -0.6), (0.9, 0.85, 0.75)), Light((-0.7, -0.3, -0.5), (0.15, 0.2, 0.3)))


@needs_povray
@pytest.mark.parametrize(("lattice", "lenses"), [("square", 45), ("hexagonal", 24)])
def test_the_engines_agree_on_a_shared_scene_of_meshes(tmp_path: Path, mi: Any, lattice: str, lenses: int) -> None:
    """The rest are pixels on edges: the median difference is 4e-6."""
    array = {"lattice": lattice, "pitch_mm": 1.0 * 45 / lenses, "focal_length_mm": 3.3 * 45 / lenses}
    spec = small_job("own", count=(lenses, lenses), lens_array=array, capture={"method": "ray_camera"})
    place = local_place(tmp_path / "data")
    job = local_job(place, spec, povray_bundle(tmp_path / "povray", MESHES, LIGHTS, stage=STAGE))
    expected = rendered_codes(place, job) / 65535
    write_for_mitsuba(tmp_path / "mitsuba", MESHES, LIGHTS)
    rows, cols = job.spec.rig.layout.rows, job.spec.rig.layout.cols
    request = Request(
        number=1,
        job=job.at(1).model_copy(update={"file": "scene.xml"}),
        frame=1,
        rows=rows,
        cols=cols,
        region=(0, rows, 0, cols),
        bundle=str(tmp_path / "mitsuba"),
        out="1",
    )
    found = shown(mi.load_file(str(tmp_path / "mitsuba" / "scene.xml")), request)
    assert expected.std(axis=(0, 1)).min() > 0.1, "the picture shows something"
    assert psnr_db(found, expected) >= LEAST_DB
    assert np.median(np.abs(found - expected)) <= 1e-4


def shown(scene: Any, request: Request) -> NDArray[np.float32]:
    """Return the picture of a request, linear (row, col, 3)."""
    from worker.engines.mitsuba.inside.shade import bands, shade_band  # they import what the variant makes

    parts = [shade_band(scene, request, rows)["radiance"] for rows in bands(request)]
    return np.concatenate(parts).reshape(request.rows, request.cols, 3)


def psnr_db(found: NDArray[np.floating[Any]], expected: NDArray[np.floating[Any]]) -> float:
    """Return the ratio of the greatest expected value to the root mean square difference."""
    error = np.square(found.astype(float) - expected.astype(float)).mean()
    return float(10 * np.log10(expected.max() ** 2 / error))
