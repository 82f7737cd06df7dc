"""Data sets for research on coding and depth, in the field's own formats."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from lippmann.job.outputs.output import Name, OutputOptions, output_kind
from lippmann.job.outputs.view_block import (
    ViewBlock,
    ViewCount,
    all_views,
    block_about_the_middle,
    check_block,
    largest_odd_square,
)
from lippmann.job.problems import Misfit
from lippmann.job.rig import Rig

MAX_CAMERAS = 1000
"""`input_Cam999.png` is the last name of three digits: beyond it the order of names is not that of numbers."""

SequenceName = Annotated[str, Field(min_length=1, max_length=60, pattern=r"^[A-Za-z0-9][A-Za-z0-9-]*$")]
"""What stands before the first `_` of the file name of a test sequence."""


class FolderOptions(OutputOptions):
    """What all data sets have that are folders, of files of several kinds."""

    SPELLINGS: ClassVar[Mapping[str, Mapping[str, Any]]] = {"": {}}

    @property
    def suffix(self) -> str:
        """None."""
        return ""


class ViewsOptions(OutputOptions):
    """What all data sets have that are made of views."""

    views: ViewCount | None = None
    """How many (down, across), about the middle one; None: all."""

    def block(self, rig: Rig) -> ViewBlock:
        """Return the views that are written."""
        return all_views(rig) if self.views is None else block_about_the_middle(rig, self.views)

    def check(self, rig: Rig, frames: Sequence[int]) -> None:
        """Refuse more views than there are."""
        if self.views is not None:
            check_block(rig, self.views, wholly=False)


@output_kind
class HciFolder(ViewsOptions, FolderOptions):
    """The folder of the HCI 4D light field benchmark, one a frame (Honauer et al., ACCV 2016)."""

    kind: Literal["hci"] = "hci"
    name: Name = "hci"
    disparity: Literal["truth", "estimate", "none"] | None = None
    """Truth is by `capture.depth`, the estimate from the pictures; None: the truth if the job has it."""
    disparity_of: Literal["middle", "all"] = "middle"
    """Of which views."""

    @property
    def depth_option(self) -> str | None:
        """The truth is asked for by `disparity`."""
        return "disparity" if self.disparity == "truth" else None

    def block(self, rig: Rig) -> ViewBlock:
        """Return the views that are written; unless said, a square with a middle, as the benchmark's tools want it."""
        return largest_odd_square(rig) if self.views is None else super().block(rig)

    def check(self, rig: Rig, frames: Sequence[int]) -> None:
        """Refuse views that do not exist, and more than the file names can number."""
        if self.views is not None:
            check_block(rig, self.views, wholly=True)
        block = self.block(rig)
        if block.rows * block.cols > MAX_CAMERAS:
            expected = f"at most {MAX_CAMERAS} views: their names have three digits"
            raise Misfit("views", expected=expected, got=f"{block.rows} x {block.cols}")


@output_kind
class SubapertureViews(ViewsOptions, FolderOptions):
    """Views as 10-bit PPM, named as the light fields of JPEG Pleno are; one folder a frame."""

    kind: Literal["subaperture_ppm"] = "subaperture_ppm"
    name: Name = "subaperture_ppm"


@output_kind
class LensletVideo(FolderOptions):
    """The integral video as MPEG's lenslet sequences are: 8-bit YUV 4:2:0 without a header, and a calibration file."""

    kind: Literal["mpeg_lenslet"] = "mpeg_lenslet"
    name: Name = "mpeg_lenslet"
    sequence: SequenceName | None = None
    """What its files are called by; None: the title of the job in letters and digits, or its scene."""
    convention: Literal["orthoscopic", "pseudoscopic"] = "orthoscopic"
    """Pseudoscopic: as captured."""


@output_kind
class NpzArrays(ViewsOptions):
    """Views as NumPy arrays (v, u, lens_row, lens_col, channel), one .npz a frame."""

    SPELLINGS: ClassVar[Mapping[str, Mapping[str, Any]]] = {".npz": {}}

    kind: Literal["npz"] = "npz"
    name: Name = "npz"
    dtype: Literal["float16", "float32", "uint8", "uint16"] = "float16"
    """Floating: linear light. Whole numbers: sRGB codes."""
    pixels: Literal["square", "lenses"] = "square"
    """Of a hexagonal lattice: views on square pixels, or one value a lens at the lens's own place."""
    compress: bool = True

    @property
    def suffix(self) -> str:
        """NPZ."""
        return ".npz"
