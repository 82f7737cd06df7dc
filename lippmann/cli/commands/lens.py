"""Imaging lenses: the published ones by name, and those in files."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from lippmann.errors import BadInput
from lippmann.terminal.output import Output

if TYPE_CHECKING:
    from lippmann.optics.lens.field_spots import FieldSpots
    from lippmann.optics.lens.surfaces import ImagingLens


def lens(
    name: Annotated[
        str | None,
        typer.Argument(
            metavar="[NAME|FILE]",
            help="The name of a published lens, or a prescription file (.json, .csv, .zmx).",
        ),
    ] = None,
    focal_length_mm: Annotated[
        float | None,
        typer.Option("--focal-length-mm", min=0.001, help="Scale a published lens to this focal length, mm."),
    ] = None,
    f_number: Annotated[
        float | None,
        typer.Option("--f-number", min=0.001, help="Set the stop to this f-number. The default is full aperture."),
    ] = None,
    *,
    output: Output,
) -> None:
    """Show an imaging lens: its surfaces, focal length, f-number and spots. With --json it is ready for a job."""
    from lippmann.cli.text.lens import lens_list, lens_text
    from lippmann.optics.lens.field_spots import field_spots
    from lippmann.optics.lens.published import IMAGING_LENSES

    if name is None:
        if focal_length_mm is not None or f_number is not None:
            raise BadInput("expected --focal-length-mm and --f-number with the name of a lens, got no name")
        found = list(IMAGING_LENSES.values())
        output.result([{"name": one.name, "title": one.title, **_numbers(one)} for one in found], lens_list(found))
        return
    chosen = _lens(name, focal_length_mm=focal_length_mm, f_number=f_number)
    spots = field_spots(chosen)
    output.result(_data(chosen, spots), lens_text(chosen, spots))


def _lens(name: str, *, focal_length_mm: float | None, f_number: float | None) -> ImagingLens:
    from lippmann.job.lens import NamedLens
    from lippmann.job.rig import Rig
    from lippmann.local.files.lens import SUFFIXES, read_prescription
    from lippmann.optics.lens.check import check_lens
    from lippmann.optics.lens.prescription import IMAGING_LENSES, chosen_lens, lens_of
    from lippmann.optics.lens.stop import with_stop

    if Path(name).suffix.lower() in SUFFIXES:
        if focal_length_mm is not None:
            raise BadInput("expected --focal-length-mm with the name of a published lens, got it with a file")
        chosen = lens_of(read_prescription(Path(name)))
        check_lens(chosen)
    else:
        if name not in IMAGING_LENSES:
            raise BadInput(
                f"expected one of {', '.join(sorted(IMAGING_LENSES))}, or a file ({', '.join(SUFFIXES)}), got {name!r}"
            )
        chosen = IMAGING_LENSES[name]
        if focal_length_mm is not None:
            chosen = chosen_lens(NamedLens(name=name, focal_length_mm=focal_length_mm))
    return with_stop(chosen, Rig(f_number=f_number))


def _data(lens: ImagingLens, spots: FieldSpots) -> dict[str, Any]:
    from lippmann.optics.lens.prescription import prescription_of

    prescription = prescription_of(lens).model_dump(mode="json", exclude_defaults=True)
    points = [
        {"field_deg": angle, "rms_radius_mm": rms_mm}
        for angle, rms_mm in zip(spots.angles_deg, spots.rms_mm, strict=True)
    ]
    return {"imaging_lens": prescription, **_numbers(lens), "spots": {"image_mm": spots.image_mm, "points": points}}


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
