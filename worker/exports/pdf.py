"""PDF pages with exact sizes: shapes, and a picture whose pixels are those of the printer.

reportlab makes the pages, embeds the font and asks viewers not to scale when they print. The picture would pass through
its memory several times, so it is appended in pieces, as an incremental update (ISO 32000-1, 7.5.6): the page refers to
an empty object, which the appended part of the file defines.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from io import BytesIO
from typing import BinaryIO

from reportlab.pdfbase.pdfmetrics import registerFont
from reportlab.pdfbase.ttfonts import TTFont
from reportlab.pdfgen.canvas import Canvas

from lippmann.errors import OutputError
from lippmann.job.optics.rig import MM_PER_INCH
from lippmann.plan.printing.shapes import Bar, Ring, Shape

POINTS_PER_MM = 72 / MM_PER_INCH
_VERSION = (1, 5)
"""The first version of PDF with pictures of 16 bits."""
_PICTURE = "picture"
_FONT = "Vera"
_MAX_BYTES = 10**10 - 1
"""The largest offset in the cross-reference table of a PDF."""


@dataclass(frozen=True)
class Page:
    """A page with its black shapes."""

    width_mm: float
    height_mm: float
    shapes: Sequence[Shape]


@dataclass(frozen=True)
class Picture:
    """A picture on a page, placed from the page's upper left corner."""

    left_mm: float
    top_mm: float
    width_mm: float
    height_mm: float
    rows: int
    cols: int
    bits: int
    profile: bytes
    """The ICC profile of its codes."""
    deflated: Iterable[bytes]
    """Its rows as PNG encodes them, in pieces."""


def write_pdf(file: BinaryIO, pages: Sequence[Page], *, title: str, picture: Picture | None = None) -> None:
    """Write pages; the same pages give the same bytes.

    Parameters
    ----------
    file
        Empty.
    pages
        Each of its own size.
    title
        For the reader's window.
    picture
        On the first page.

    Raises
    ------
    OutputError
        If the file would be longer than 10^10 bytes.
    """
    made = _pages(pages, title, picture)
    file.write(made)
    if picture is not None:
        _append(file, picture, made)


def _pages(pages: Sequence[Page], title: str, picture: Picture | None) -> bytes:
    registerFont(TTFont(_FONT, "Vera.ttf"))
    made = BytesIO()
    canvas = Canvas(made, pageCompression=1, invariant=1, pdfVersion=_VERSION, initialFontName=_FONT)
    canvas.setTitle(title)
    for say in (canvas.setAuthor, canvas.setCreator, canvas.setSubject):
        say("lippmann")
    canvas.setViewerPreference("PrintScaling", "None")
    if picture is not None:
        canvas.beginForm(_PICTURE)
        canvas.endForm()
    for number, page in enumerate(pages):
        canvas.setPageSize((page.width_mm * POINTS_PER_MM, page.height_mm * POINTS_PER_MM))
        if picture is not None and number == 0:
            _place(canvas, page, picture)
        for shape in page.shapes:
            _draw(canvas, page, shape)
        canvas.showPage()
    canvas.save()
    return made.getvalue()


def _place(canvas: Canvas, page: Page, picture: Picture) -> None:
    """Refer to the picture, which is one unit wide and high, drawn upward."""
    bottom_mm = page.height_mm - picture.top_mm - picture.height_mm
    wide, high, left, bottom = (
        POINTS_PER_MM * number for number in (picture.width_mm, picture.height_mm, picture.left_mm, bottom_mm)
    )
    canvas.saveState()
    canvas.transform(wide, 0, 0, high, left, bottom)
    canvas.doForm(_PICTURE)
    canvas.restoreState()


def _draw(canvas: Canvas, page: Page, shape: Shape) -> None:
    def up(from_top_mm: float) -> float:
        return (page.height_mm - from_top_mm) * POINTS_PER_MM

    k = POINTS_PER_MM
    if isinstance(shape, Bar):
        canvas.rect(shape.left_mm * k, up(shape.bottom_mm), shape.width_mm * k, shape.height_mm * k, stroke=0, fill=1)
    elif isinstance(shape, Ring):
        canvas.setLineWidth(shape.line_mm * k)
        canvas.circle(shape.x_mm * k, up(shape.y_mm), shape.radius_mm * k, stroke=1, fill=0)
    else:
        canvas.setFont(_FONT, shape.size_mm * k)
        write = canvas.drawCentredString if shape.centred else canvas.drawString
        write(shape.x_mm * k, up(shape.baseline_mm), shape.text)


def _append(file: BinaryIO, picture: Picture, made: bytes) -> None:
    """Append the picture under the number of the empty object that the page refers to."""
    number = int(_found(rb"/FormXob\.picture (\d+) 0 R", made))
    trailer = made[made.rindex(b"trailer") :]
    length, profile = int(_found(rb"/Size (\d+)", trailer)), int(_found(rb"/Size (\d+)", trailer)) + 1
    places: dict[int, int] = {number: file.tell()}
    file.write(_opened(picture, number, length=length, profile=profile))
    start = file.tell()
    for piece in picture.deflated:
        file.write(piece)
    size = file.tell() - start
    places[length] = file.tell() + len(b"\nendstream\nendobj\n")
    file.write(b"\nendstream\nendobj\n%d 0 obj\n%d\nendobj\n" % (length, size))
    places[profile] = file.tell()
    head = b"%d 0 obj\n<< /N 3 /Alternate /DeviceRGB /Length %d >>\nstream\n" % (profile, len(picture.profile))
    file.write(head + picture.profile + b"\nendstream\nendobj\n")
    if file.tell() > _MAX_BYTES:
        raise OutputError(f"expected a PDF of at most 10^10 bytes, got {file.tell()}")
    _write_places(file, places, trailer)


def _opened(picture: Picture, number: int, *, length: int, profile: int) -> bytes:
    said = (
        f"{number} 0 obj\n<< /Type /XObject /Subtype /Image /Width {picture.cols} /Height {picture.rows}"
        f" /BitsPerComponent {picture.bits} /ColorSpace [/ICCBased {profile} 0 R] /Interpolate false"
        f" /Filter /FlateDecode /DecodeParms << /Predictor 15 /Colors 3 /BitsPerComponent {picture.bits}"
        f" /Columns {picture.cols} >> /Length {length} 0 R >>\nstream\n"
    )
    return said.encode("ascii")


def _write_places(file: BinaryIO, places: dict[int, int], trailer: bytes) -> None:
    """Write a cross-reference table of the new objects that refers to the previous table for the others."""
    table_at = file.tell()
    file.write(b"xref\n0 1\n0000000000 65535 f \n")
    for number in sorted(places):
        file.write(b"%d 1\n%010d 00000 n \n" % (number, places[number]))
    kept = b" ".join(b"/%s %s" % (key, _found(rb"/%s\s+(\d+ 0 R)" % key, trailer)) for key in (b"Root", b"Info"))
    before = _found(rb"startxref\s+(\d+)", trailer)
    identity = _found(rb"/ID\s*(\[[^\]]*\])", trailer)
    file.write(
        b"trailer\n<< /Size %d %s /ID %s /Prev %s >>\nstartxref\n%d\n%%%%EOF\n"
        % (max(places) + 1, kept, identity, before, table_at)
    )


def _found(pattern: bytes, text: bytes) -> bytes:
    match = re.search(pattern, text)
    if match is None:
        raise OutputError(f"expected a PDF with {pattern!r}, got one without")
    return match[1]
