"""Integral images from elsewhere."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from lippmann.cli.options import AsJson
from lippmann.terminal.output import Talk

if TYPE_CHECKING:
    from lippmann.local.import_sheets import Imported


def views(
    files: Annotated[
        list[Path], typer.Argument(metavar="FILE...", help="PNG, TIFF or EXR; several are frames of a sequence.")
    ],
    out: Annotated[Path, typer.Option(help="The folder to write to.")] = Path("out"),
    pitch_px: Annotated[float | None, typer.Option(help="Pixels across a lens, any number: 23.622.")] = None,
    lattice: Annotated[Literal["square", "hexagonal"] | None, typer.Option(help="How lenses stand.")] = None,
    row_pitch_px: Annotated[
        float | None, typer.Option(help="From lens row to lens row, if not as on square pixels.")
    ] = None,
    rotation_deg: Annotated[float | None, typer.Option(help="Turn of the lens rows, clockwise.")] = None,
    offset_px: Annotated[
        str | None, typer.Option(metavar="DOWN,RIGHT", help="Centre of the first whole lens, from the top left corner.")
    ] = None,
    lens_count: Annotated[tuple[int, int] | None, typer.Option(metavar="ROWS COLS", help="How many lenses.")] = None,
    first_row_shifted: Annotated[
        bool, typer.Option("--first-row-shifted", help="Hexagonal: the first lens row stands further right.")
    ] = False,
    px_per_lens: Annotated[int | None, typer.Option(help="Of the cells that are made of it.")] = None,
    find_from: Annotated[Path | None, typer.Option(help="A white image through the same lenses.")] = None,
    find: Annotated[bool, typer.Option("--find", help="Find the lenses in the first picture itself.")] = False,
    pseudoscopic: Annotated[
        bool | None, typer.Option("--pseudoscopic/--orthoscopic", help="Depth is inside out, or as it should be.")
    ] = None,
    inverted: Annotated[
        bool | None, typer.Option("--inverted/--upright", help="The picture is upside down, or not.")
    ] = None,
    pitch_mm: Annotated[float | None, typer.Option(help="Pitch of the lenses.")] = None,
    focal_length_mm: Annotated[float | None, typer.Option(help="Focal length of the lenses, the gap.")] = None,
    bundle: Annotated[
        Path | None, typer.Option(help="Also write them here as a bundle for a job: lippmann scenes upload.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Take integral images from elsewhere into the chain: whole cells, turned as they must be, and all their views.

    `lippmann view`, without s, takes one view of what this leaves.
    """
    from lippmann.local.import_sheets import Wanted, geometry_data, import_here, write_bundle

    said: dict[str, Any] = {
        "pitch_px": pitch_px,
        "lattice": lattice,
        "row_pitch_px": row_pitch_px,
        "rotation_deg": rotation_deg,
        "offset_px": None if offset_px is None else _pair(offset_px),
        "count": lens_count,
        "first_row_shifted": first_row_shifted or None,
        "px_per_lens": px_per_lens,
        "pseudoscopic": pseudoscopic,
        "inverted": inverted,
        "pitch_mm": pitch_mm,
        "focal_length_mm": focal_length_mm,
    }
    wanted = Wanted({name: value for name, value in said.items() if value is not None}, white=find_from, find=find)
    imported = import_here(files, wanted, out=out)
    if bundle is not None:
        write_bundle(files, imported.lenses, bundle, title=files[0].stem)
    talk = Talk(as_json)
    for note in imported.lenses.notes:
        talk.note(f"note: {note}")
    lenses = imported.lenses
    data = {"known_by": lenses.known_by, "agreement": lenses.agreement, "geometry": geometry_data(lenses)}
    talk.result(data | {"files": [str(path) for path in imported.files]}, _told(imported))


def _pair(text: str) -> tuple[float, float]:
    from lippmann.errors import BadInput

    try:
        down, right = map(float, text.split(","))
    except ValueError as error:
        raise BadInput(f"expected --offset-px as DOWN,RIGHT in px, got {text!r}") from error
    return down, right


def _told(imported: Imported) -> str:
    lenses = imported.lenses
    sure = f" (agreement {lenses.agreement:.2f} of 1)" if lenses.agreement is not None else ""
    by = {"said": "as said", "white": "found in the white image", "picture": "found in the picture",
          "header": "as its header says"}[lenses.known_by]  # fmt: skip
    return "\n".join((f"{lenses.grid}: {by}{sure}", *map(str, imported.files)))
