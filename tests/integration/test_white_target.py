"""A rendered white image, as a camera sees it through imaging lens and array, tells where the light of each lens is."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from lippmann.job.spec import JobSpec
from lippmann.lattice.cell import Lattice
from lippmann.lightfield.calibrate.calibrate import calibrate_white_image
from lippmann.lightfield.calibrate.whole_lenses import in_middle
from lippmann.lightfield.sheet.lens_grid import LensGrid
from lippmann.local.files.bundle import find_bundle
from lippmann.optics.rig.bench import bench
from lippmann.plan.sampling import frame_size
from tests.builders import small_job
from tests.unit.lippmann.lightfield.lens_pictures import off_lattice_px
from worker.settings import WorkerSettings
from worker.tasks.local import capture_frame
from worker.untrusted import read_imported


def _white(folder: Path, **rig: Any) -> tuple[JobSpec, NDArray[np.float32]]:
    """Return the job and the capture of white through a slow imaging lens."""
    spec = small_job("target-white", count=(16, 18), px_per_lens=10, rig={"f_number": 5.6}, **rig)
    _, bundle = find_bundle("target-white")
    capture_frame(spec, bundle, frame=1, out=folder, on_progress=lambda *_: None, settings=WorkerSettings(slots=1))
    return spec, read_imported(folder / "integral/0001.exr")


@pytest.mark.parametrize("lattice", ["square", "hexagonal"])
def test_the_images_of_the_pupil_are_found_about_the_middle(tmp_path: Path, lattice: Lattice) -> None:
    spec, picture = _white(tmp_path, lens_array={"lattice": lattice})
    found, layout = calibrate_white_image(picture).grid, frame_size(spec.rig)
    assert found.lattice == lattice
    # 1 + f / D, D from the exit pupil to the array, 425 mm; the same both ways.
    apart = found.pitch_px / layout.px_per_lens
    assert 1.005 < apart < 1.01
    assert found.row_px / layout.row_px == pytest.approx(apart, rel=2e-3)
    assert found.turn_deg == pytest.approx(0, abs=0.05)
    spots = LensGrid(16, 18, found.pitch_px, (0.0, 0.0), lattice, row_pitch_px=found.row_px)
    assert off_lattice_px(in_middle(spots, picture.shape[:2]), found) < 0.1


def test_a_near_camera_sees_them_further_apart_by_focal_length_over_its_distance(tmp_path: Path) -> None:
    _, far = _white(tmp_path / "far")
    spec, near = _white(tmp_path / "near", camera={"projection": "perspective"})
    optical_bench = bench(spec.rig, reference_mm=1000.0)
    more = calibrate_white_image(near).grid.pitch_px / calibrate_white_image(far).grid.pitch_px - 1
    expected = spec.rig.lens_array.focal_length_mm / (optical_bench.camera_z_mm - optical_bench.mla_z_mm)
    assert more == pytest.approx(expected, rel=0.1)
