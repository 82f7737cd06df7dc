"""Imaging lenses: what there is by name, and what a file holds."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from lippmann.cli.options import AsJson
from lippmann.terminal.output import Talk

if TYPE_CHECKING:
    from lippmann.optics.lens.surfaces import ImagingLens


def lens(
    name: Annotated[
        str | None,
        typer.Argument(
            metavar="[NAME|FILE]", help="A lens by name, or a file (.json, .csv, .zmx); without it, all names."
        ),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Show an imaging lens: surfaces, focal length, f-number; as JSON, ready for a job."""
    from lippmann.cli.text.lens import lens_list, lens_text
    from lippmann.optics.lens.published import IMAGING_LENSES

    if name is None:
        found = list(IMAGING_LENSES.values())
        Talk(as_json).result(
            [{"name": one.name, "title": one.title, **_numbers(one)} for one in found], lens_list(found)
        )
        return
    chosen = _lens(name)
    Talk(as_json).result(_data(chosen), lens_text(chosen))


def _lens(name: str) -> ImagingLens:
    from lippmann.local.files.lens import SUFFIXES, read_prescription
    from lippmann.optics.lens.check import check_lens
    from lippmann.optics.lens.prescription import imaging_lens, lens_of

    if Path(name).suffix.lower() not in SUFFIXES:
        return imaging_lens(name, field="NAME")
    chosen = lens_of(read_prescription(Path(name)))
    check_lens(chosen)
    return chosen


def _data(lens: ImagingLens) -> dict[str, Any]:
    from lippmann.optics.lens.prescription import prescription_of

    prescription = prescription_of(lens).model_dump(mode="json", exclude_defaults=True)
    return {"imaging_lens": prescription, **_numbers(lens)}


def _numbers(lens: ImagingLens) -> dict[str, float]:
    from lippmann.optics.lens.matrices import cardinal_points
    from lippmann.optics.lens.stop import f_number

    points = cardinal_points(lens)
    return {
        "efl_mm": points.effective_focal_length_mm,
        "back_focal_mm": points.back_focal_distance_mm,
        "front_focal_mm": points.front_focal_distance_mm,
        "f_number": f_number(lens),
    }
