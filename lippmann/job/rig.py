"""The rig as it was asked for: imaging lens, microlens array, camera, and the pixels under a lens."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, Tag, model_validator

from lippmann.job.lens import NamedLens, Prescription
from lippmann.job.presets import LENS_ARRAYS
from lippmann.job.problems import Misfit, told_by
from lippmann.lattice.cell import Lattice
from lippmann.lattice.kinds import CELLS
from lippmann.lattice.layout import CellLayout
from lippmann.lattice.lenses import LensLattice

MIN_PX_PER_LENS = 2
"""One pixel per lens holds one view: no parallax, hence no integral image."""

DEFAULT_PX_PER_LENS = 8
"""The paper's for integral video (Athineos et al. 2006, section 4.2)."""

MAX_FRAME_PX = 32_768
"""The longest side of an integral image that one frame may have."""

PAPER_CAMERA_ANGLE_DEG = 6.738
"""One tenth of POV-Ray's default 67.38 degrees (Athineos et al. 2006, section 3.2)."""

MM_PER_INCH = 25.4


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


def _form_of_lens(value: Any) -> str:
    if not isinstance(value, Mapping):
        return "name"
    return "prescription" if "surfaces" in value else "scaled"


LensChoice = Annotated[
    Annotated[str, Field(min_length=1, max_length=100), Tag("(name)")]
    | Annotated[NamedLens, Tag("(scaled)")]
    | Annotated[Prescription, Tag("(prescription)")],
    told_by(_form_of_lens),
]
"""A lens by name, by name and focal length, or surface by surface."""


class LensArray(_Part):
    """The microlens array (MLA)."""

    preset: str | None = None
    """An array on the market: gives the numbers that are not said."""
    lattice: Lattice = "square"
    """Hexagonal: every second lens row shifted by half a pitch, lens rows pitch x sqrt(3) / 2 apart."""
    count: tuple[Annotated[int, Field(ge=1, le=4096)], Annotated[int, Field(ge=1, le=4096)]] = (90, 90)
    """Lenses as (lens_rows, lens_cols)."""
    pitch_mm: float = Field(default=1.0, gt=0, le=1000)
    focal_length_mm: float = Field(default=3.3, gt=0, le=10_000)
    index: float = Field(default=1.49, gt=1, le=4)
    aperture: Literal["full", "inscribed"] = "full"
    """Where the rim of a lens lies: through the corners of its cell, or on the circle inside it."""
    offset_mm: float = Field(default=40.0, ge=-1e6, le=1e6)
    """From the image of the scene's reference plane to the MLA, positive toward the imaging lens."""
    substrate_mm: float = Field(default=0.0, ge=0, le=1000)
    """Glass below the lenses of the array on the display; the array of the capture is thin."""

    @model_validator(mode="before")
    @classmethod
    def _fill_in_preset(cls, data: Any) -> Any:
        if not isinstance(data, Mapping) or not isinstance(data.get("preset"), str):
            return data
        if data["preset"] not in LENS_ARRAYS:
            known = ", ".join(sorted(LENS_ARRAYS))
            raise Misfit("preset", expected=f"one of {known}", got=repr(data["preset"]))
        return {**LENS_ARRAYS[data["preset"]], **data}

    @property
    def lenses_mm(self) -> LensLattice:
        """The lenses, in mm from the middle of the array."""
        return LensLattice(*self.count, kind=self.lattice, pitch=self.pitch_mm)


class Camera(_Part):
    """The camera behind the MLA."""

    projection: Literal["orthographic", "perspective"] = "orthographic"
    angle_deg: float = Field(default=PAPER_CAMERA_ANGLE_DEG, ge=0.001, lt=90)
    """Full angle of view of the perspective camera; its distance follows from it."""


WindowPx = Annotated[int, Field(ge=1, le=MAX_FRAME_PX)]


class Device(_Part):
    """The printer or panel that shows the integral image: the pitch of its pixels, and its window."""

    dpi: float | None = Field(default=None, gt=0, le=100_000)
    pitch_um: float | None = Field(default=None, gt=0, le=100_000)
    """Of pixels; either this or `dpi`."""
    margin_px: int = Field(default=0, ge=0, le=MAX_FRAME_PX)
    """Dark pixels around the array."""
    window_px: tuple[WindowPx, WindowPx] | None = None
    """(rows, cols) of the whole picture, the array in its middle; either this or `margin_px`."""

    @model_validator(mode="after")
    def _said_once(self) -> Self:
        if (self.dpi is None) == (self.pitch_um is None):
            raise Misfit("dpi", expected="either this or pitch_um", got="neither" if self.dpi is None else "both")
        if self.window_px is not None and self.margin_px:
            raise Misfit("margin_px", expected="either this or window_px", got="both")
        return self

    @property
    def pixel_mm(self) -> float:
        """Pitch of the device's pixels."""
        if self.dpi is not None:
            return MM_PER_INCH / self.dpi
        assert self.pitch_um is not None  # noqa: S101 - checked
        return self.pitch_um / 1000


class Rig(_Part):
    """Imaging lens, MLA and camera."""

    imaging_lens: LensChoice | None = "athineos-2006"
    """None: the MLA stands in the scene's own space (direct pickup)."""
    f_number: float | None = Field(default=None, gt=0, le=10_000)
    """Sets the aperture stop of the imaging lens; fully open when neither this nor `stop_mm` is given."""
    stop_mm: float | None = Field(default=None, gt=0, le=10_000)
    """Diameter of the hole of the aperture stop."""
    dispersion: bool = False
    """Whether glass whose Abbe number is known spreads colours."""
    lens_array: LensArray = LensArray()
    camera: Camera = Camera()
    px_per_lens: int = Field(default=DEFAULT_PX_PER_LENS, ge=MIN_PX_PER_LENS, le=512)
    device: Device | None = None

    @model_validator(mode="before")
    @classmethod
    def _fill_in_px_per_lens(cls, data: Any) -> Any:
        """Take as many pixels a lens as the device has, when nothing is said."""
        if not isinstance(data, Mapping) or "px_per_lens" in data or not data.get("device"):
            return data
        try:
            array = LensArray.model_validate(data.get("lens_array", {}))
            needed = math.ceil(round(array.pitch_mm / Device.model_validate(data["device"]).pixel_mm, 1))
        except ValueError:
            return data  # what is wrong there is said by the field itself
        step = array.lenses_mm.cell.row_period
        return {**data, "px_per_lens": max(MIN_PX_PER_LENS, -(-needed // step) * step)}

    @model_validator(mode="after")
    def _fits_in_a_picture(self) -> Self:
        longest = max(self.lens_array.count) * self.px_per_lens
        if longest > MAX_FRAME_PX:
            expected = f"count x px_per_lens of at most {MAX_FRAME_PX} px a side"
            raise Misfit("px_per_lens", expected=expected, got=f"{longest} px")
        return self

    @model_validator(mode="after")
    def _one_stop(self) -> Self:
        if self.f_number is not None and self.stop_mm is not None:
            raise Misfit("f_number", expected="either this or stop_mm", got="both")
        if self.imaging_lens is None and (self.f_number is not None or self.stop_mm is not None):
            field = "f_number" if self.f_number is not None else "stop_mm"
            raise Misfit(field, expected="an imaging lens for the stop to stand in", got="imaging_lens null")
        return self

    @model_validator(mode="after")
    def _even_under_hexagons(self) -> Self:
        check_px_per_lens(self.px_per_lens, self.lens_array.lattice)
        return self

    @property
    def layout(self) -> CellLayout:
        """The pixels of the integral images that the rig captures, and the lenses over them."""
        array = self.lens_array
        return CellLayout(*array.count, px_per_lens=self.px_per_lens, lattice=array.lattice)


def check_px_per_lens(px_per_lens: int, lattice: Lattice) -> None:
    """Refuse a number of pixels that a lens of this lattice cannot have across.

    Parameters
    ----------
    px_per_lens
        The pixels across a lens.
    lattice
        The kind of the lattice.

    Raises
    ------
    Misfit
        If the number is odd and lens rows are shifted by half a lens.
    """
    if px_per_lens % CELLS[lattice].row_period:
        expected = "an even number on a hexagonal lattice, whose rows are shifted by half a lens"
        raise Misfit("px_per_lens", expected=expected, got=px_per_lens)
