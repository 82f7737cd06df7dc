"""Where the lenses lie on integral images from elsewhere, as their maker says it."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

from worker.job.misfit import Misfit
from worker.job.rig import MAX_FRAME_PX, MIN_PX_PER_LENS

FOCAL_IN_PITCHES = 3.3
"""Of an array that nothing is said of: the paper's."""

Px = Annotated[float, Field(ge=-MAX_FRAME_PX, le=MAX_FRAME_PX)]
Count = Annotated[int, Field(ge=1, le=4096)]
PitchPx = Annotated[float, Field(ge=MIN_PX_PER_LENS, le=MAX_FRAME_PX)]


class SheetGeometry(BaseModel):
    """The lenses over an integral image from elsewhere, and what must be turned to show it."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    pitch_px: PitchPx
    """Across a lens, any number."""
    lattice: Literal["square", "hexagonal"] = "square"
    row_pitch_px: PitchPx | None = None
    """From one lens row to the next; what square pixels make of the pitch when not given."""
    first_row_shifted: bool = False
    """Hexagonal: the first lens row is one of those half a lens further right."""
    rotation_deg: float = Field(default=0.0, ge=-45, le=45)
    """Of the lens rows, clockwise as one looks at the picture."""
    offset_px: tuple[Px, Px] | None = None
    """Centre of the first lens, (down, right) from the picture's top left corner; when not given, the lenses stand in
    the middle of the picture."""
    count: tuple[Count, Count] | None = None
    """(lens_rows, lens_cols); as many whole ones as there are when not given."""
    px_per_lens: int | None = Field(default=None, ge=MIN_PX_PER_LENS, le=4096)
    """Of the cells that are made of it; the whole number nearest the pitch, even for hexagons, when not given."""
    pseudoscopic: bool = False
    """Depth is inside out, as an array records it: every elemental image must be turned by half a turn."""
    inverted: bool = False
    """The picture is upside down, as a lens before the array leaves it."""
    pitch_mm: float | None = Field(default=None, gt=0, le=1000)
    """Of the lenses; 1 mm when not given, and then depths are only relative."""
    focal_length_mm: float | None = Field(default=None, gt=0, le=10_000)
    """Of the lenses, the display's gap; 3.3 pitches when not given."""

    @property
    def lens_pitch_mm(self) -> float:
        """Of the lenses, said or not."""
        return self.pitch_mm or 1.0

    def lens_focal_mm(self, pitch_mm: float) -> float:
        """Return the lenses' focal length, said or not, at a pitch."""
        return self.focal_length_mm or FOCAL_IN_PITCHES * pitch_mm

    @model_validator(mode="after")
    def _shifted_among_hexagons(self) -> Self:
        if self.first_row_shifted and self.lattice == "square":
            raise Misfit("first_row_shifted", expected="false on a square lattice", got="true")
        if self.lattice == "hexagonal" and self.px_per_lens is not None and self.px_per_lens % 2:
            raise Misfit("px_per_lens", expected="an even number for hexagons", got=self.px_per_lens)
        return self
