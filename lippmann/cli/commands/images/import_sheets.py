"""Integral images that other programs or cameras made."""

from __future__ import annotations

import functools
import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from lippmann.cli.options import LensCount, Lenses, OutputFolder
from lippmann.errors import BadInput
from lippmann.terminal.output import Output

if TYPE_CHECKING:
    from lippmann.local.files.source_pictures import Decoding
    from lippmann.local.importing.import_sheets import ImportResult


def import_sheets(
    files: Annotated[
        list[Path],
        typer.Argument(
            metavar="FILE...",
            help="PNG, TIFF, JPEG, EXR, PFM or PPM files, or with --views also folders. Several files, and the pages of"
            " a TIFF, are the frames of a sequence.",
        ),
    ],
    out: OutputFolder = Path("out"),
    pitch_px: Annotated[
        float | None, typer.Option(help="The lens pitch, px. It need not be a whole number, for example 23.622.")
    ] = None,
    lattice: Annotated[Literal["square", "hexagonal"] | None, typer.Option(help="The lattice of the lenses.")] = None,
    row_pitch_px: Annotated[
        float | None,
        typer.Option(help="The distance between lens rows, px. The default is the one of a regular lattice."),
    ] = None,
    rotation_deg: Annotated[
        float | None, typer.Option(help="The rotation of the lens rows, degrees clockwise.")
    ] = None,
    first_lens_px: Annotated[
        str | None,
        typer.Option(
            "--first-lens-px",
            metavar="RIGHT,DOWN",
            help="The centre of the first whole lens, px to the right and down from the top left corner.",
        ),
    ] = None,
    offset_px: Annotated[str | None, typer.Option("--offset-px", hidden=True, metavar="DOWN,RIGHT")] = None,
    wanted_lenses: Lenses = None,
    lens_count: LensCount = None,
    first_row_shifted: Annotated[
        bool,
        typer.Option("--first-row-shifted", help="The first row of a hexagonal lattice is shifted to the right."),
    ] = False,
    px_per_lens: Annotated[int | None, typer.Option(help="The pixels across a lens of the imported image.")] = None,
    find_from: Annotated[
        Path | None, typer.Option(help="Calibrate with this white image through the same lenses.")
    ] = None,
    find: Annotated[bool, typer.Option("--find", help="Find the lenses in the first picture itself.")] = False,
    pseudoscopic: Annotated[
        bool | None, typer.Option("--pseudoscopic/--orthoscopic", help="Whether depth is inverted.")
    ] = None,
    inverted: Annotated[
        bool | None, typer.Option("--inverted/--upright", help="Whether the picture is upside down.")
    ] = None,
    pitch_mm: Annotated[float | None, typer.Option(help="The pitch of the lenses, mm.")] = None,
    focal_length_mm: Annotated[float | None, typer.Option(help="The focal length of the lenses, mm.")] = None,
    linear: Annotated[
        bool, typer.Option("--linear", help="Read the codes of the pictures as linear light, whatever the files say.")
    ] = False,
    white_level: Annotated[
        int | None, typer.Option(help="The code of white, as 4095 of 12 bits that are stored in 16.", min=1, max=65_535)
    ] = None,
    white: Annotated[
        Path | None,
        typer.Option(help="Divide the pictures by this white image through the same lenses, which removes vignetting."),
    ] = None,
    views: Annotated[
        Literal["row", "grid"] | None,
        typer.Option(
            help="The files are quilts or folders of views: one row of views from the left to the right, or rows and"
            " columns."
        ),
    ] = None,
    view_names: Annotated[
        Literal["column_row", "row_column"] | None,
        typer.Option(help="The order of the two numbers in the names of views. JPEG Pleno has column_row."),
    ] = None,
    bundle: Annotated[
        Path | None, typer.Option(help="The folder for a scene bundle, which `lippmann scenes upload` takes for a job.")
    ] = None,
    *,
    output: Output,
) -> None:
    """Import integral images from elsewhere. They become orthoscopic masters, with all their views."""
    from lippmann.cli.option_values import count_of, first_lens_of
    from lippmann.local.files.source_pictures import Decoding
    from lippmann.local.importing.import_bundle import geometry_data
    from lippmann.local.importing.import_sheets import ImportOptions, import_sheets

    options: dict[str, Any] = {
        "pitch_px": pitch_px,
        "lattice": lattice,
        "row_pitch_px": row_pitch_px,
        "rotation_deg": rotation_deg,
        "offset_px": first_lens_of(first_lens_px, offset_px),
        "count": count_of(wanted_lenses, lens_count),
        "first_row_shifted": first_row_shifted or None,
        "px_per_lens": px_per_lens,
        "pseudoscopic": pseudoscopic,
        "inverted": inverted,
        "pitch_mm": pitch_mm,
        "focal_length_mm": focal_length_mm,
    }
    fields = {name: value for name, value in options.items() if value is not None}
    decoding = Decoding(linear=linear, white_level=white_level)
    if views is not None:
        if find or find_from is not None or white is not None:
            raise BadInput("expected no --find, --find-from and --white with --views, in which nothing is left to find")
        imported = _import_views(files, fields, views, view_names, decoding, out=out)
    elif view_names is not None:
        raise BadInput("expected --view-names with --views only")
    else:
        chosen = ImportOptions(fields, find_from=find_from, find=find, decoding=decoding, white=white)
        imported = import_sheets(files, chosen, out=out)
    if bundle is not None:
        _write_bundle(files, imported, bundle, decoding=decoding, white=white, of_views=views is not None)
    for note in imported.notes:
        output.note(f"note: {note}")
    lenses = imported.lenses
    data = {"known_by": lenses.known_by, "agreement": lenses.agreement, "geometry": geometry_data(lenses)}
    output.result(data | {"files": [str(path) for path in imported.files]}, _text(imported))


def _import_views(
    files: list[Path],
    fields: dict[str, Any],
    parallax: Literal["row", "grid"],
    order: Literal["column_row", "row_column"] | None,
    decoding: Decoding,
    *,
    out: Path,
) -> ImportResult:
    """Import views, whose names and number say where the lenses are."""
    from lippmann.local.importing.import_views import ViewsOptions, import_views

    known = ("px_per_lens", "pseudoscopic", "pitch_mm", "focal_length_mm")
    others = [name for name in fields if name not in known]
    if others:
        option = {"count": "lenses", "offset_px": "first-lens-px"}.get(others[0], others[0].replace("_", "-"))
        raise BadInput(f"expected no --{option} with --views: every pixel of a view is a lens")
    return import_views(files, ViewsOptions(parallax, order, decoding=decoding, **fields), out=out)


def _write_bundle(
    files: list[Path], imported: ImportResult, bundle: Path, *, decoding: Decoding, white: Path | None, of_views: bool
) -> None:
    from lippmann.local.files.source_pictures import SourcePicture, source_pictures
    from lippmann.local.importing.import_bundle import write_bundle

    title = os.fsencode(files[0].stem).decode("utf-8", "replace")
    if of_views:
        # A job takes integral images: those that were made of the views, in linear light.
        sheets = [SourcePicture(path) for path in imported.files if path.parent.name == "orthoscopic"]
        pictures = [sheet for sheet in sheets if sheet.path.suffix == ".exr"]
        write_bundle(pictures, imported.lenses, bundle, title=title)
    else:
        write_bundle(source_pictures(files), imported.lenses, bundle, title=title, decoding=decoding, white=white)


@functools.wraps(import_sheets)
def views(**values: Any) -> None:
    """Import integral images; this is the old name of `lippmann import`."""
    values["output"].note("note: `lippmann views` is now `lippmann import`; the next release drops the old name")
    import_sheets(**values)


def _text(imported: ImportResult) -> str:
    lenses = imported.lenses
    agreement = f" (agreement {lenses.agreement:.2f} of 1)" if lenses.agreement is not None else ""
    source = {
        "said": "as the options give it",
        "white": "found in the white image",
        "picture": "found in the picture",
        "header": "as the header gives it",
    }[lenses.known_by]
    return "\n".join((f"{lenses.grid}: {source}{agreement}", *map(str, imported.files)))
