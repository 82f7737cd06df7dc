"""Data sets for research on coding and depth, in the formats of the field."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from lippmann.job.fields.problems import FieldError
from lippmann.job.optics.rig import Rig
from lippmann.job.outputs.output import Name, OutputOptions, output_kind
from lippmann.job.outputs.view_block import (
    ViewBlock,
    ViewCount,
    all_views,
    block_about_the_middle,
    check_block,
    largest_odd_square,
)

MAX_CAMERAS = 1000
"""`input_Cam999.png` is the last name of three digits: beyond it, names do not sort in the order of numbers."""

SequenceName = Annotated[str, Field(min_length=1, max_length=60, pattern=r"^[A-Za-z0-9][A-Za-z0-9-]*$")]
"""The name of a test sequence, which ends at the first `_` of its file name."""


class FolderOptions(OutputOptions):
    """The base of data sets that are folders with several kinds of files."""

    SPELLINGS: ClassVar[Mapping[str, Mapping[str, Any]]] = {"": {}}

    @property
    def suffix(self) -> str:
        """The suffix is empty: the output is a folder."""
        return ""


class ViewsOptions(OutputOptions):
    """The base of data sets that are made of views."""

    views: ViewCount | None = None
    """The number of views (down, across) around the middle one; None means all."""

    def block(self, rig: Rig) -> ViewBlock:
        """Return the block of views that are written."""
        return all_views(rig) if self.views is None else block_about_the_middle(rig, self.views)

    def check(self, rig: Rig, frames: Sequence[int]) -> None:
        """Refuse more views than a lens has."""
        if self.views is not None:
            check_block(rig, self.views, wholly=False)


@output_kind
class HciFolder(ViewsOptions, FolderOptions):
    """Folders of the HCI 4D light field benchmark, one per frame (Honauer et al., ACCV 2016)."""

    kind: Literal["hci"] = "hci"
    name: Name = "hci"
    disparity: Literal["truth", "estimate", "none"] | None = None
    """`truth` is from `capture.depth`, `estimate` from the pictures; the default is `truth` if the job has it."""
    disparity_of: Literal["middle", "all"] = "middle"
    """The views for which disparity is written."""

    @property
    def depth_option(self) -> str | None:
        """The option `disparity` asks for the truth."""
        return "disparity" if self.disparity == "truth" else None

    def block(self, rig: Rig) -> ViewBlock:
        """Return the block of views that are written; the default is an odd square, as the benchmark expects."""
        return largest_odd_square(rig) if self.views is None else super().block(rig)

    def check(self, rig: Rig, frames: Sequence[int]) -> None:
        """Refuse views that do not exist, and more views than the file names can number."""
        if self.views is not None:
            check_block(rig, self.views, wholly=True)
        block = self.block(rig)
        if block.rows * block.cols > MAX_CAMERAS:
            expected = f"at most {MAX_CAMERAS} views: their names have three digits"
            raise FieldError("views", expected=expected, got=f"{block.rows} x {block.cols}")
        if self.disparity == "estimate":
            self._check_estimate(rig, block)

    def _check_estimate(self, rig: Rig, block: ViewBlock) -> None:
        """Refuse estimates of views that have no views on both sides, which the structure tensor needs."""
        of_all = self.disparity_of == "all"
        for view in block.numbers if of_all else (block.numbers[block.middle],):
            if not rig.layout.has_views_on_both_sides(*view):
                field, got, choice = (
                    ("disparity_of", "'all'", "middle") if of_all else ("disparity", "'estimate'", "none")
                )
                expected = f"{choice}, or views that have views on both sides, which an estimate needs"
                raise FieldError(field, expected=expected, got=f"{got} with view {view} of {rig.layout}")


@output_kind
class SubapertureViews(ViewsOptions, FolderOptions):
    """Views as 10-bit PPM with the names of JPEG Pleno's light fields, one folder per frame."""

    kind: Literal["subaperture_ppm"] = "subaperture_ppm"
    name: Name = "subaperture_ppm"


@output_kind
class LensletVideo(FolderOptions):
    """The integral video in the format of MPEG's lenslet sequences: raw 8-bit YUV 4:2:0 with a calibration file."""

    kind: Literal["mpeg_lenslet"] = "mpeg_lenslet"
    name: Name = "mpeg_lenslet"
    sequence: SequenceName | None = None
    """The name of the sequence; the default is the title of the job in letters and digits, or its scene."""
    convention: Literal["orthoscopic", "pseudoscopic"] = "orthoscopic"
    """The convention of the frames; `pseudoscopic` is as captured."""


@output_kind
class NpzArrays(ViewsOptions):
    """Views as NumPy arrays (v, u, lens_row, lens_col, channel), one .npz per frame."""

    SPELLINGS: ClassVar[Mapping[str, Mapping[str, Any]]] = {".npz": {}}

    kind: Literal["npz"] = "npz"
    name: Name = "npz"
    dtype: Literal["float16", "float32", "uint8", "uint16"] = "float16"
    """The type of the numbers: floating-point types hold linear light, integers hold sRGB codes."""
    pixels: Literal["square", "lenses"] = "square"
    """The views of a hexagonal lattice: on square pixels, or one value per lens at the place of the lens."""
    compress: bool = True
    """True if the arrays are compressed."""

    @property
    def suffix(self) -> str:
        """The suffix of NPZ files."""
        return ".npz"
