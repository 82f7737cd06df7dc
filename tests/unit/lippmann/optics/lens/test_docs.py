"""What docs/imaging-lenses.md says is so."""

from __future__ import annotations

import json
import re

import pytest

from lippmann.job.optics.glasses import glass
from lippmann.job.optics.lens import LensSurface, NamedLens, Prescription
from lippmann.job.optics.rig import Rig
from lippmann.job.spec import parse_spec
from lippmann.optics.lens.check import check_lens
from lippmann.optics.lens.field_spots import field_spots
from lippmann.optics.lens.matrices import cardinal_points
from lippmann.optics.lens.prescription import chosen_lens, lens_of, rig_lens
from lippmann.optics.lens.published import IMAGING_LENSES
from lippmann.optics.lens.stop import f_number, with_stop
from lippmann.optics.lens_files.csv_files import read_lens_csv
from tests.repository import DOCS

PAGE = (DOCS / "imaging-lenses.md").read_text("utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", PAGE, re.DOTALL)


def test_every_lens_of_the_page_is_one_a_job_takes() -> None:
    choices, own = blocks("json")
    for text in [*choices.splitlines(), own]:
        rig = json.loads(text)["rig"]
        pickup = {"lens_array": {"offset_mm": -10}} if rig["imaging_lens"] is None else {}
        lens = rig_lens(parse_spec({"scene": "fish", "rig": {**rig, **pickup}}).rig)
        assert (lens is None) == bool(pickup)


def test_the_csv_of_the_page_is_a_lens() -> None:
    (text,) = blocks("text")
    prescription = read_lens_csv(text).prescription
    assert len(prescription.surfaces) == 4
    assert prescription.stop_z_mm == pytest.approx(11.76)
    check_lens(lens_of(prescription))


def test_the_table_of_lenses_is_measured() -> None:
    rows = re.findall(r"^\| `([a-z0-9-]+)` \| [^|]* \| ([0-9.]+) mm \| ([0-9.]+) \|", PAGE, re.MULTILINE)
    assert [name for name, _, _ in rows] == list(IMAGING_LENSES)
    for name, efl_mm, fastest in rows:
        lens = IMAGING_LENSES[name]
        assert float(efl_mm) == pytest.approx(cardinal_points(lens).effective_focal_length_mm, abs=5.1e-4)
        assert float(fastest) == pytest.approx(f_number(lens), abs=5.1e-3)


def test_the_table_of_spots_is_computed() -> None:
    rows = re.findall(r"^\| `([a-z0-9-]+)` \| ([0-9., ]+) \| ([0-9., ]+) \| ([0-9., ]+) \|$", PAGE, re.MULTILINE)
    assert [name for name, *_ in rows] == list(IMAGING_LENSES)
    for name, *cells in rows:
        named = NamedLens(name=name, focal_length_mm=300)
        for cell, stop in zip(cells, (None, 4, 8), strict=True):
            spots = field_spots(with_stop(chosen_lens(named), Rig(imaging_lens=named, f_number=stop)))
            assert spots.angles_deg == pytest.approx((0.0, 4.0, 8.0))
            assert cell == ", ".join(f"{rms_mm:.3g}" for rms_mm in spots.rms_mm if rms_mm is not None)


def test_every_field_of_a_surface_is_on_the_page() -> None:
    documented = set(re.findall(r"^\| `([a-z_]+)` \|", PAGE, re.MULTILINE)) - set(IMAGING_LENSES)
    prescription = set(Prescription.model_fields) - {"title", "source", "surfaces"}
    assert documented == set(LensSurface.model_fields) | prescription


def test_every_glass_of_the_page_is_known() -> None:
    (paragraph,) = re.findall(r"^Glasses known by name:.*?\n\n", PAGE, re.MULTILINE | re.DOTALL)
    for name in re.findall(r"`([A-Z0-9-]+)`", paragraph):
        assert glass(name) is not None
