"""Imaging lenses: the published ones by name, and those in files."""

from __future__ import annotations

from collections.abc import Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from lippmann.errors import BadInput
from lippmann.terminal.output import Output

if TYPE_CHECKING:
    from lippmann.optics.lens.field_spots import FieldSpots
    from lippmann.optics.lens.surfaces import ImagingLens
    from lippmann.optics.lens_files.lens_file import LensFile


def lens(
    name: Annotated[
        str | None,
        typer.Argument(
            metavar="[NAME|FILE]",
            help="The name of a published lens, or a prescription file (.json, .csv, .zmx, .seq).",
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
    catalogues: Annotated[
        list[Path] | None,
        typer.Option(
            "--catalogue",
            metavar="FILE.agf",
            help="A glass catalogue for the glasses of the file; repeat it for several. They count in their order.",
        ),
    ] = None,
    *,
    output: Output,
) -> None:
    """Show an imaging lens: surfaces, focal length and spots. With --json, its prescription is ready for a job."""
    from lippmann.cli.text.lens import lens_list, lens_text
    from lippmann.optics.lens.field_spots import field_spots
    from lippmann.optics.lens.prescription import lens_of
    from lippmann.optics.lens.published import IMAGING_LENSES

    if name is None:
        if focal_length_mm is not None or f_number is not None or catalogues:
            raise BadInput("expected --focal-length-mm, --f-number and --catalogue with a lens, got no lens")
        found = list(IMAGING_LENSES.values())
        output.result([{"name": one.name, "title": one.title, **_numbers(one)} for one in found], lens_list(found))
        return
    file = _file(name, catalogues or (), focal_length_mm=focal_length_mm)
    chosen = _with_stop(_published(name, focal_length_mm) if file is None else lens_of(file.prescription), f_number)
    spots = field_spots(chosen)
    notes = () if file is None else file.notes
    for note in notes:
        output.note(f"note: {note}")
    places = () if file is None else file.places
    output.result(_data(chosen, spots) | {"notes": list(notes)}, lens_text(chosen, spots, places))


def _file(name: str, catalogues: Sequence[Path], *, focal_length_mm: float | None) -> LensFile | None:
    """Return the lens in a file, or None for the name of a published lens."""
    from lippmann.local.files.lens import CATALOGUE_SUFFIX, SUFFIXES, read_lens
    from lippmann.optics.lens.published import IMAGING_LENSES

    path = Path(name)
    suffix = path.suffix.lower()
    if suffix in SUFFIXES:
        if focal_length_mm is not None:
            raise BadInput("expected --focal-length-mm with the name of a published lens, got it with a file")
        return read_lens(path, catalogues)
    if name in IMAGING_LENSES:
        if catalogues:
            raise BadInput(f"expected --catalogue with a lens file ({', '.join(SUFFIXES)}), got it with {name}")
        return None
    if suffix or path.exists():
        hint = " (a glass catalogue goes with --catalogue)" if suffix == CATALOGUE_SUFFIX else ""
        raise BadInput(f"expected a lens as {', '.join(SUFFIXES)}, got {path.name or name}{hint}")
    like = "".join(
        f" (did you mean {meant}?)" for meant in get_close_matches(name[:100].lower(), IMAGING_LENSES, n=1, cutoff=0.5)
    )
    names = ", ".join(sorted(IMAGING_LENSES))
    raise BadInput(f"expected one of {names}{like}, or a file ({', '.join(SUFFIXES)}), got {name!r}")


def _published(name: str, focal_length_mm: float | None) -> ImagingLens:
    from lippmann.job.optics.lens import NamedLens
    from lippmann.optics.lens.prescription import IMAGING_LENSES, chosen_lens

    if focal_length_mm is None:
        return IMAGING_LENSES[name]
    return chosen_lens(NamedLens(name=name, focal_length_mm=focal_length_mm))


def _with_stop(lens: ImagingLens, f_number: float | None) -> ImagingLens:
    from lippmann.job.optics.rig import Rig
    from lippmann.optics.lens.stop import with_stop

    return with_stop(lens, Rig(f_number=f_number))


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
        "back_focal_distance_mm": points.back_focal_distance_mm,
        "front_focal_distance_mm": points.front_focal_distance_mm,
        "f_number": f_number(lens),
    }
