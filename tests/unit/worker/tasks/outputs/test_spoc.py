"""Sheets for another display: masters that are read like any other, pictures beside them, and what is told of them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lippmann.errors import SpecError
from lippmann.job.optics.rig import Rig
from lippmann.job.outputs.spoc import Spoc
from lippmann.lightfield.sheet.pinholes import PinholeArray
from lippmann.local.image import open_orthoscopic
from lippmann.plan import artifact_names as names
from lippmann.plan.sampling import display_size
from tests.builders import small_job
from tests.builders_outputs import given_job
from tests.pictures import read_png
from tests.unit.lippmann.lightfield.sheet.test_spoc import disparity, point_at
from tests.unit.lippmann.lightfield.textures import sheet_of_texture
from worker.images.colour import srgb_codes
from worker.images.read import read_rgb


def test_with_nothing_said_the_display_is_the_captures_own(tmp_path: Path) -> None:
    job = given_job(tmp_path, frames="1-2", outputs=[{"kind": "spoc"}])
    job.make("spoc")
    for frame in (1, 2):
        with job.file(names.orthoscopic_name(frame)) as master, job.file(f"exports/spoc/000{frame}.exr") as made:
            np.testing.assert_array_equal(read_rgb(made, np.float16), read_rgb(master, np.float16))
        with job.file(f"exports/spoc/000{frame}.exr") as made, job.file(f"exports/spoc/000{frame}.png") as picture:
            np.testing.assert_array_equal(read_png(picture), srgb_codes(read_rgb(made, np.float16)))


@pytest.mark.parametrize("lattice", ["square", "hexagonal"])
def test_a_point_is_where_it_should_be_before_the_new_display(lattice: str, tmp_path: Path) -> None:
    depth_mm, distance_mm = 12.0, -5.0
    output = {
        "kind": "spoc", "name": "panel", "lattice": lattice, "pitch_mm": 0.8, "px_per_lens": 12, "gap_mm": 4.0,
        "distance_mm": distance_mm, "reference_mm": depth_mm, "bits": 16,
    }  # fmt: skip
    # An odd number of hexagonal lens rows: after the turn of the sheet the even ones are shifted.
    options: dict[str, Any] = {"count": (25, 25), "px_per_lens": 32, "lens_array": {"lattice": "hexagonal"}}
    layout = display_size(small_job("target-white", **options).rig)
    assert layout.first_row_shifted
    light = sheet_of_texture(layout, point_at(1.0, -0.6), depth_mm, focal_mm=3.3).repeat(3, axis=2)
    job = given_job(tmp_path, {1: light}, outputs=[output], **options)
    job.make("panel")
    with job.file("exports/panel/0001.exr") as made:
        shown = open_orthoscopic(made)
    assert (shown.pitch_mm, shown.focal_length_mm, shown.layout.px_per_lens) == (0.8, 4.0, 12)
    assert shown.layout.lattice == lattice
    # As many lenses as stand on the same area: 25 x 25 mm, or 25 x 0.866 mm high.
    assert (shown.layout.lens_rows, shown.layout.lens_cols) == ((27, 31) if lattice == "square" else (31, 31))
    array = PinholeArray(shown.layout, shown.pitch_mm, shown.focal_length_mm)
    theory = (depth_mm - distance_mm) / (4.0 * 12)
    assert disparity(shown.pixels, array) == pytest.approx(theory, rel=0.02)
    said = job.sidecar("panel")
    assert said["files"] == ["exports/panel/0001.exr", "exports/panel/0001.png"]
    assert said["integral_image"]["pitch_px"] == 32
    image = said["format"]["integral_image"]
    assert (image["lattice"], image["pitch_px"], image["pitch_mm"], image["gap_mm"]) == (lattice, 12, 0.8, 4.0)
    assert image["size_px"] == list(shown.pixels.shape[:2])
    assert said["format"]["reference_mm"] == depth_mm


def test_the_rig_of_the_display_has_the_depths_of_the_display() -> None:
    rig = Rig.model_validate({"lens_array": {"offset_mm": 40.0}})
    assert Spoc().reference_of(rig) == pytest.approx(43.3)
    output = Spoc(gap_mm=2.0, distance_mm=10.0)
    shown = output.display(rig)
    # What is at z before the capture's pinholes is at z - 10 mm before the display's, and a gap nearer to its lenses.
    assert Spoc().reference_of(shown) == pytest.approx(33.3)
    assert shown.lens_array.offset_mm == pytest.approx(31.3)
    assert Spoc().display(rig).lens_array.offset_mm == pytest.approx(40.0)


@pytest.mark.parametrize(
    ("output", "rig", "said"),
    [
        ({"lattice": "hexagonal", "px_per_lens": 7}, {}, "outputs.0.px_per_lens: expected an even number on a hexag"),
        ({"lattice": "hexagonal"}, {"px_per_lens": 9}, "outputs.0.px_per_lens: expected an even number on a hexag"),
        ({"count": [4096, 4096], "px_per_lens": 9}, {}, "px_per_lens: expected count x px_per_lens of at most"),
        ({"pitch_mm": 0.001}, {}, "pitch_mm: expected a pitch at which at most 4096 lenses"),
        ({"reference_mm": 0}, {}, "outputs.0.reference_mm: expected a depth other than 0"),
        ({}, {"lens_array": {"offset_mm": -3.3}}, "outputs.0.reference_mm: expected a depth other than 0"),
        ({"gap_mm": -1}, {}, "outputs.0.gap_mm: expected a number above 0, got -1"),
        ({"lattice": "round"}, {}, "outputs.0.lattice: expected 'square' or 'hexagonal', got 'round'"),
    ],
    ids=str,
)  # fmt: skip
def test_what_cannot_be_is_refused_with_the_job(output: dict[str, Any], rig: dict[str, Any], said: str) -> None:
    with pytest.raises(SpecError) as refused:
        small_job("target-white", rig=rig, outputs=[{"kind": "spoc", **output}])
    assert said in str(refused.value)


def test_an_attempt_goes_on_where_another_was_stopped(tmp_path: Path) -> None:
    job = given_job(tmp_path, outputs=[{"kind": "spoc"}])
    job.make("spoc")
    first = job.place.store.etag("local/exports/spoc/0001.exr")
    job.place.store.delete("local/exports/spoc.json")
    job.place.store.delete("local/exports/spoc/0001.png")
    job.make("spoc")
    assert job.place.store.etag("local/exports/spoc/0001.exr") == first
    assert job.place.store.exists("local/exports/spoc/0001.png")
