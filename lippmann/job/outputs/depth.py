"""The depth map of a view of every frame."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import Field, model_validator

from lippmann.job.fields.problems import FieldError
from lippmann.job.optics.rig import Rig
from lippmann.job.outputs.output import Name, OutputOptions, output_kind
from lippmann.job.outputs.view_block import check_view

Index = Annotated[int, Field(ge=0, le=4096)]
DepthMm = Annotated[float, Field(ge=-1e6, le=1e6)]


@output_kind
class DepthPictures(OutputOptions):
    """The depth map of a view, one file per frame."""

    SPELLINGS: ClassVar[Mapping[str, Mapping[str, Any]]] = {
        ".png": {},
        ".exr": {"file_format": "exr"},
        ".pfm": {"file_format": "pfm"},
    }

    kind: Literal["depth"] = "depth"
    name: Name = "depth"
    source: Literal["truth", "estimate"] = "truth"
    """`truth` is from `capture.depth`, `estimate` from the pictures."""
    file_format: Literal["png", "exr", "pfm"] = "png"
    """PNG has colours; EXR has s, disparity and z or confidence as floats; PFM has the disparity."""
    u: Index | None = None
    """The column of the view; the default is the middle one."""
    v: Index | None = None
    """The row of the view; both u and v, or neither."""
    method: Literal["tensor", "sweep"] = "tensor"
    """The method of the estimate: slopes of lines in epipolar images, or a plane sweep."""
    reach: int = Field(default=2, ge=1, le=16)
    """The number of views on each side that the estimate uses."""
    farthest_mm: DepthMm | None = None
    """The far end of the range of depths of the display for the estimate and the colours."""
    nearest_mm: DepthMm | None = None
    """The near end of the range; both ends, or neither."""

    @property
    def suffix(self) -> str:
        """The suffix of the file format."""
        return f".{self.file_format}"

    @property
    def depth_option(self) -> str | None:
        """The option `source` asks for the truth."""
        return "source" if self.source == "truth" else None

    @property
    def range_mm(self) -> tuple[float, float] | None:
        """The range of depths of the estimate, the farthest first; None if it is not given."""
        if self.farthest_mm is None or self.nearest_mm is None:
            return None
        return self.farthest_mm, self.nearest_mm

    @model_validator(mode="after")
    def _both_or_neither(self) -> Self:
        pairs = ("u", "v", self.u, self.v), ("farthest_mm", "nearest_mm", self.farthest_mm, self.nearest_mm)
        for first, second, one, other in pairs:
            if (one is None) != (other is None):
                raise FieldError(second if other is None else first, expected="both or neither", got="nothing")
        if self.range_mm is not None and not self.range_mm[0] < self.range_mm[1]:
            raise FieldError("nearest_mm", expected=f"more than farthest_mm, {self.farthest_mm:g}", got=self.nearest_mm)
        return self

    def check(self, rig: Rig, frames: Sequence[int]) -> None:
        """Refuse a view that does not exist."""
        layout = rig.layout
        view = (layout.cell_cols // 2, layout.cell_rows // 2)
        if self.u is not None and self.v is not None:
            view = self.u, self.v
            check_view("u", rig, view)
        if self.source == "estimate" and self.method == "tensor" and not layout.has_views_on_both_sides(*view):
            expected = "sweep, or a view with views on both sides of it"
            raise FieldError("method", expected=expected, got=f"'tensor' for view {view} of {layout}")
