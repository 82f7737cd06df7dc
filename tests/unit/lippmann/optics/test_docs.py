"""The numbers in docs/optics.md are computed."""

from __future__ import annotations

import re

import pytest

from lippmann.job.optics.rig import LensArray, Rig
from lippmann.optics.lens.matrices import cardinal_points, conjugate
from lippmann.optics.lens.published import IMAGING_LENSES
from lippmann.optics.lens.stop import f_number
from lippmann.optics.rig.bench import bench
from tests.repository import DOCS

PAGE = (DOCS / "optics.md").read_text("utf-8")


def row(quantity: str) -> list[float]:
    """Return the numbers in the second cell of a row."""
    (cell,) = re.findall(rf"^\| {re.escape(quantity)} \| ([^|]*) \|", PAGE, re.MULTILINE)
    numbers = re.findall(r"-?\d+\.\d+", cell)
    return [float(number) for number in numbers]


def test_the_table_of_the_imaging_lens_is_computed() -> None:
    lens = IMAGING_LENSES["athineos-2006"]
    points = cardinal_points(lens)
    near, far = conjugate(lens, 1000.0), conjugate(lens, 2500.0)
    depth_mm = near.image_mm - far.image_mm
    assert row("effective focal length") == [round(points.effective_focal_length_mm, 3)]
    assert row("back focal distance") == [round(points.back_focal_distance_mm, 3)]
    assert row("f-number") == [round(f_number(lens), 3)]
    assert row("object 1000 mm before surface 1") == [round(near.image_mm, 3), round(near.magnification, 5)]
    assert row("object 2500 mm") == [round(far.image_mm, 3), round(far.magnification, 5)]
    assert row("image depth, compression") == [round(depth_mm, 3), round(1500 / depth_mm, 2)]


def test_the_table_of_displacements_is_computed() -> None:
    rows = re.findall(r"^\| (square|hexagonal) \| `(full|inscribed)`.* \| ([0-9.]+) mm \|$", PAGE, re.MULTILINE)
    assert len(rows) == 4
    for lattice, aperture, said_mm in rows:
        rig = Rig(lens_array=LensArray(lattice=lattice, aperture=aperture))
        assert bench(rig, reference_mm=1000.0).microlens.displacement_mm == pytest.approx(float(said_mm), abs=5e-7)
