"""Still pictures: of every frame, or one for the whole job."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import Field, model_validator

from lippmann.job.animation.frames import FrameList, parse_frames
from lippmann.job.fields.model import at_most
from lippmann.job.fields.problems import FieldError
from lippmann.job.optics.rig import MAX_FRAME_PX, Rig
from lippmann.job.optics.viewing import Filter
from lippmann.job.outputs.output import Name, OutputOptions, output_kind

Count = Annotated[int, Field(ge=1, le=4096)]
Index = Annotated[int, Field(ge=0, le=4096)]


@output_kind
class ViewGrid(OutputOptions):
    """All views side by side, v down and u across."""

    SPELLINGS: ClassVar[Mapping[str, Mapping[str, Any]]] = {".png": {}}

    kind: Literal["view_grid"] = "view_grid"
    name: Name = "view_grid"
    bits: Literal[8, 16] = 8
    """The bits of each colour channel."""

    @property
    def suffix(self) -> str:
        """The suffix of PNG files."""
        return ".png"


@output_kind
class Sheets(OutputOptions):
    """A master of every frame as an sRGB picture, pixel for pixel."""

    SPELLINGS: ClassVar[Mapping[str, Mapping[str, Any]]] = {".png": {}, ".tif": {"file_format": "tiff"}}

    kind: Literal["sheets"] = "sheets"
    name: Name = "sheets"
    of: Literal["orthoscopic", "integral", "views", "device"] = "orthoscopic"
    """The master: `integral` is the capture, pseudoscopic, `device` the image on the pixels of `rig.device`."""
    file_format: Literal["png", "tiff"] = "png"
    """The file format."""
    bits: Literal[8, 16] = 8
    """The bits of each colour channel."""

    @property
    def suffix(self) -> str:
        """The suffix of PNG or TIFF files."""
        return {"png": ".png", "tiff": ".tif"}[self.file_format]

    def check(self, rig: Rig, frames: Sequence[int]) -> None:
        """Refuse the image on the pixels of a device if the rig has no device."""
        if self.of == "device" and rig.device is None:
            raise FieldError("of", expected="orthoscopic, integral or views without rig.device", got=repr(self.of))


class PictureOptions(OutputOptions):
    """The base of pictures that consist of views; they are PNGs."""

    SPELLINGS: ClassVar[Mapping[str, Mapping[str, Any]]] = {".png": {}}

    scale: float = Field(default=1.0, gt=0, le=64)
    """The scale of every view; 1 is one pixel per lens."""
    filter: Filter = "lanczos3"
    """The filter that scales the views."""
    bits: Literal[8, 16] = 8
    """The bits of each colour channel."""

    @property
    def suffix(self) -> str:
        """The suffix of PNG files."""
        return ".png"

    def check_size(self, rows: float, cols: float) -> None:
        """Refuse a picture that is too large, by its pixels at scale 1."""
        longest = math.ceil(max(rows, cols) * self.scale)
        if longest > MAX_FRAME_PX:
            raise FieldError("scale", expected=f"a picture of at most {MAX_FRAME_PX} px a side", got=f"{longest} px")


@output_kind
class Quilt(PictureOptions):
    """Views as tiles, the leftmost at the lower left, for displays with horizontal parallax (Looking Glass)."""

    kind: Literal["quilt"] = "quilt"
    name: Name = "quilt"
    views: Literal["row", "all"] = "row"
    """The views of one row; or all views, with a row of tiles for each row of views, the lowest below."""
    view_row: Index | None = None
    """The v of the row; the default is the middle row."""
    count: Count | None = None
    """The number of views from the leftmost to the rightmost, interpolated; the default is those that exist."""
    columns: Count | None = None
    """The columns of tiles; the default is somewhat more than the rows."""
    aspect: float | None = Field(default=None, ge=0.01, le=100)
    """Width by height of a tile, to which views are cropped around their middle; the default is that of the view."""

    @model_validator(mode="after")
    def _all_are_a_grid(self) -> Self:
        for field, number in (("view_row", self.view_row), ("count", self.count), ("columns", self.columns)):
            if self.views == "all" and number is not None:
                raise FieldError(
                    field, expected="nothing with views all, whose tiles are the grid of views", got=number
                )
        return self

    def tile_columns(self, count: int) -> int:
        """Return the number of columns for a number of tiles.

        Raises
        ------
        FieldError
            If the tiles do not fill the columns.

        Examples
        --------
        >>> [Quilt().tile_columns(count) for count in (8, 45, 48, 7)]
        [4, 9, 8, 7]
        """
        if self.columns is None:
            return count // next(rows for rows in range(math.isqrt(count), 0, -1) if count % rows == 0)
        if count % self.columns:
            raise FieldError("columns", expected=f"a number that divides the {count} views", got=self.columns)
        return self.columns

    def check(self, rig: Rig, frames: Sequence[int]) -> None:
        """Refuse a row of views that does not exist, columns that leave gaps, and a picture that is too large."""
        if self.views == "all" and not rig.layout.mask.all():
            expected = "row on a hexagonal lattice, where the views at the corners do not exist"
            raise FieldError("views", expected=expected, got="'all'")
        rows_of_views = rig.layout.rows_of_views
        if self.view_row is not None and self.view_row not in rows_of_views:
            expected = f"a row in which there are views, from {rows_of_views[0]} to {rows_of_views[-1]}"
            raise FieldError("view_row", expected=expected, got=self.view_row)
        if self.views == "all":
            columns = rows = rig.px_per_lens
        else:
            row = rig.layout.cell_rows // 2 if self.view_row is None else self.view_row
            count = self.count or len(rig.layout.views_in_row(row))
            columns = self.tile_columns(count)
            rows = count // columns
        self.check_size(rig.lens_array.count[0] * rows, rig.lens_array.count[1] * columns)


@output_kind
class Epi(PictureOptions):
    """Epipolar images: slices of the light field along a line of lenses and the views along it."""

    kind: Literal["epi"] = "epi"
    name: Name = "epi"
    lens_rows: Annotated[tuple[Index, ...], Field(max_length=4096), at_most(4096)] = ()
    """Horizontal slices: u down, lenses across. If no lens is named, the middle row."""
    lens_cols: Annotated[tuple[Index, ...], Field(max_length=4096), at_most(4096)] = ()
    """Vertical slices: v across, lenses down."""
    view_px: int = Field(default=1, ge=1, le=64)
    """The width of the line of each view, in pixels."""
    gap_px: int = Field(default=2, ge=0, le=256)
    """The dark pixels between slices."""

    def check(self, rig: Rig, frames: Sequence[int]) -> None:
        """Refuse lenses that do not exist, and a picture that is too large."""
        rows, cols = rig.lens_array.count
        for place, lens in enumerate(self.lens_rows):
            check_index(f"lens_rows.{place}", lens, rows)
        for place, lens in enumerate(self.lens_cols):
            check_index(f"lens_cols.{place}", lens, cols)
        slice_px = view_rows(rig) * self.view_px + self.gap_px
        self.check_size(max(rows, len(self.lens_rows) * slice_px), max(cols, len(self.lens_cols) * slice_px))


@output_kind
class ContactSheet(PictureOptions):
    """Small pictures side by side, with captions, in one picture for the job."""

    kind: Literal["contact_sheet"] = "contact_sheet"
    name: Name = "contact_sheet"
    show: Literal["frames", "views"] = "frames"
    """The centre view of each frame, or all views of the first frame."""
    frames: FrameList | None = None
    """The frames, as in a job: "1-48:2, 60"; the default is all."""
    every: Count = 1
    """The step: every n-th frame, or every n-th view in u and in v."""
    columns: Count | None = None
    """The columns; the default is about the number of rows, or the number of views in u."""
    gap_px: int = Field(default=8, ge=0, le=256)
    """The pixels between pictures."""
    captions: bool = True
    """True if every picture has a caption."""

    def check(self, rig: Rig, frames: Sequence[int]) -> None:
        """Refuse frames that the job does not have, and a picture that is too large."""
        shown = frames if self.frames is None else parse_frames(self.frames)
        foreign = set(shown) - set(frames)
        if foreign:
            raise FieldError("frames", expected="frames of the job", got=f"{min(foreign)}, which is none of them")
        pictures = -(-len(shown) // self.every)
        columns = self.columns or math.isqrt(pictures - 1) + 1
        if self.show == "views":
            sides = [-(-side // self.every) for side in (view_rows(rig), rig.px_per_lens)]
            pictures, columns = math.prod(sides), self.columns or sides[1]
        rows, gap = -(-pictures // columns), self.gap_px / self.scale
        self.check_size(rows * (rig.lens_array.count[0] + 3 * gap), columns * (rig.lens_array.count[1] + gap))


def view_rows(rig: Rig) -> int:
    """Return the number of rows of views of a rig: the pixel rows of the box of a cell."""
    return rig.layout.cell_rows


def check_index(field: str, index: int | None, count: int) -> None:
    """Refuse an index that does not exist.

    Raises
    ------
    FieldError
        The error names the field.
    """
    if index is not None and index >= count:
        raise FieldError(field, expected=f"a number from 0 to {count - 1}", got=index)
