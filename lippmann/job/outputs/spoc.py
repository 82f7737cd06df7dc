"""The integral image for another display, by the smart pseudoscopic-to-orthoscopic conversion."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Literal

from pydantic import Field

from lippmann.job.fields.problems import FieldError
from lippmann.job.optics.rig import MAX_FRAME_PX, MIN_PX_PER_LENS, Rig, check_px_per_lens
from lippmann.job.outputs.output import Name, OutputOptions, output_kind
from lippmann.lattice.cell import Lattice
from lippmann.lattice.kinds import CELLS

MAX_LENSES = 4096
"""The most lenses on a side, as of the rig's array."""

Rows = Annotated[int, Field(ge=1, le=MAX_LENSES, title="Rows")]
Cols = Annotated[int, Field(ge=1, le=MAX_LENSES, title="Columns")]


@output_kind
class Spoc(OutputOptions):
    """An integral image for another display, of every frame: an EXR master, and a PNG for viewing and printing.

    Options that are not given are those of the capture.
    """

    kind: Literal["spoc"] = "spoc"
    name: Name = "spoc"
    lattice: Lattice | None = None
    """The lattice of the lenses of the display."""
    count: tuple[Rows, Cols] | None = Field(default=None, title="Lenses")
    """The lenses of the display as (lens_rows, lens_cols); the default covers the same area."""
    pitch_mm: float | None = Field(default=None, gt=0, le=1000)
    """The pitch of the lenses of the display."""
    px_per_lens: int | None = Field(default=None, ge=MIN_PX_PER_LENS, le=512)
    """The pixels across a lens of the display."""
    gap_mm: float | None = Field(default=None, gt=0, le=10_000)
    """The reduced gap from the lenses of the display to its pixels; the default is the focal length of the capture."""
    distance_mm: float = Field(default=0.0, ge=-1e6, le=1e6)
    """The distance of the display in front of the capture's own display: all depths decrease by it."""
    reference_mm: float | None = Field(default=None, ge=-1e6, le=1e6)
    """The depth that is kept exactly; the default is that of the scene's reference plane."""
    bits: Literal[8, 16] = 8
    """The bits of the PNG."""

    @property
    def suffix(self) -> str:
        """The suffix is empty: every frame has two files."""
        return ""

    def check(self, rig: Rig, frames: Sequence[int]) -> None:
        """Refuse a display that cannot be built, and a reference plane in the array of the capture."""
        self.display(rig)
        self.reference_of(rig)

    def reference_of(self, rig: Rig) -> float:
        """Return z of the reference plane from the pinholes of a capture, which stand a focal length before its array.

        Raises
        ------
        FieldError
            If the plane lies in them.
        """
        array = rig.lens_array
        found = array.offset_mm + array.focal_length_mm if self.reference_mm is None else self.reference_mm
        if found == 0:
            got = 0 if self.reference_mm is not None else "nothing, and the scene's reference plane is at 0"
            raise FieldError(
                "reference_mm", expected="a depth other than 0, where every ray meets its own lens", got=got
            )
        return found

    def display(self, rig: Rig) -> Rig:
        """Return the rig that would have captured for the display: its array, gap and pixels, and the depths there.

        Raises
        ------
        FieldError
            If there are too many lenses or pixels, or they do not fit the lattice.
        """
        array = rig.lens_array
        lattice, pitch_mm = self.lattice or array.lattice, self.pitch_mm or array.pitch_mm
        count, n = self.count or self._same_area(rig, pitch_mm, lattice), self.px_per_lens or rig.px_per_lens
        check_px_per_lens(n, lattice)
        if max(count) * n > MAX_FRAME_PX:
            expected = f"count x px_per_lens of at most {MAX_FRAME_PX} px a side"
            raise FieldError("px_per_lens", expected=expected, got=f"{max(count) * n} px")
        gap_mm = self.gap_mm or array.focal_length_mm
        lens_array = {
            "lattice": lattice,
            "count": count,
            "pitch_mm": pitch_mm,
            "focal_length_mm": gap_mm,
            "offset_mm": array.offset_mm + array.focal_length_mm - self.distance_mm - gap_mm,
            "preset": None,
        }
        update = {"px_per_lens": n, "device": None, "lens_array": array.model_copy(update=lens_array)}
        return rig.model_copy(update=update)

    def _same_area(self, rig: Rig, pitch_mm: float, lattice: Lattice) -> tuple[int, int]:
        array = rig.lens_array
        across = array.pitch_mm / pitch_mm
        down = across * CELLS[array.lattice].row_pitch / CELLS[lattice].row_pitch
        rows, cols = (max(1, round(lenses * more)) for lenses, more in zip(array.count, (down, across), strict=True))
        if max(rows, cols) > MAX_LENSES:
            expected = f"a pitch at which at most {MAX_LENSES} lenses stand side by side, or a count"
            raise FieldError("pitch_mm", expected=expected, got=f"{pitch_mm:g} mm, which makes {max(rows, cols)}")
        return rows, cols
