"""The rig of a job: imaging lens, microlens array, camera, device, and the pixels of a lens."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, Literal, Self

from pydantic import Field, Tag, model_validator

from lippmann.job.fields.model import JobModel
from lippmann.job.fields.problems import FieldError, form_discriminator
from lippmann.job.optics.lens import NamedLens, Prescription
from lippmann.job.presets import LENS_ARRAYS
from lippmann.lattice.cell import Lattice
from lippmann.lattice.kinds import CELLS
from lippmann.lattice.layout import CellLayout
from lippmann.lattice.lenses import LensLattice

MIN_PX_PER_LENS = 2
"""The least number of pixels across a lens; one pixel records a single view, which has no parallax."""

DEFAULT_PX_PER_LENS = 8
"""The pixels across a lens in the paper's integral video (Athineos et al. 2006, section 4.2)."""

MAX_FRAME_PX = 32_768
"""The greatest width or height of an integral image."""

PAPER_CAMERA_ANGLE_DEG = 6.738
"""The angle of view of the paper's camera, one tenth of POV-Ray's default of 67.38 degrees (Athineos et al. 2006,
section 3.2)."""

MM_PER_INCH = 25.4


def _form_of_lens(value: Any) -> str:
    if not isinstance(value, Mapping):
        return "name"
    return "prescription" if "surfaces" in value else "scaled"


LensChoice = Annotated[
    Annotated[str, Field(min_length=1, max_length=100), Tag("(name)")]
    | Annotated[NamedLens, Tag("(scaled)")]
    | Annotated[Prescription, Tag("(prescription)")],
    form_discriminator(_form_of_lens),
]
"""An imaging lens: its name, its name and focal length, or its prescription."""


LensRows = Annotated[int, Field(ge=1, le=4096, title="Rows")]
LensCols = Annotated[int, Field(ge=1, le=4096, title="Columns")]


class LensArray(JobModel):
    """The microlens array (MLA)."""

    preset: str | None = Field(default=None, examples=sorted(LENS_ARRAYS))
    """The name of an array on the market, which supplies the numbers that are absent."""
    lattice: Lattice = "square"
    """The lattice of the lenses. On a hexagonal lattice every second lens row is shifted by half a pitch, and lens rows
    are pitch x sqrt(3) / 2 apart."""
    count: tuple[LensRows, LensCols] = Field(default=(90, 90), title="Lenses")
    """The number of lenses as (lens_rows, lens_cols)."""
    pitch_mm: float = Field(default=1.0, gt=0, le=1000)
    """The pitch of the lenses."""
    focal_length_mm: float = Field(default=3.3, gt=0, le=10_000)
    """The focal length of the lenses."""
    index: float = Field(default=1.49, gt=1, le=4)
    """The refractive index of the lenses."""
    aperture: Literal["full", "inscribed"] = "full"
    """The rim of a lens: `full` is the circle through the corners of its cell, `inscribed` the circle inside the
    cell."""
    offset_mm: float = Field(default=40.0, ge=-1e6, le=1e6)
    """The distance from the image of the scene's reference plane to the MLA, positive toward the imaging lens."""
    substrate_mm: float = Field(default=0.0, ge=0, le=1000)
    """The thickness of the substrate of the array on the display; the array of the capture has none."""

    @model_validator(mode="before")
    @classmethod
    def _fill_in_preset(cls, data: Any) -> Any:
        if not isinstance(data, Mapping) or not isinstance(data.get("preset"), str):
            return data
        if data["preset"] not in LENS_ARRAYS:
            known = ", ".join(sorted(LENS_ARRAYS))
            raise FieldError("preset", expected=f"one of {known}", got=repr(data["preset"]))
        return {**LENS_ARRAYS[data["preset"]], **data}

    @property
    def lenses_mm(self) -> LensLattice:
        """The lattice of the lenses, in mm from the middle of the array."""
        return LensLattice(*self.count, kind=self.lattice, pitch=self.pitch_mm)


class Camera(JobModel):
    """The camera behind the MLA."""

    projection: Literal["orthographic", "perspective"] = "orthographic"
    """The projection of the camera."""
    angle_deg: float = Field(default=PAPER_CAMERA_ANGLE_DEG, ge=0.001, lt=90)
    """The full angle of view of a perspective camera, which determines its distance from the MLA."""


WindowRows = Annotated[int, Field(ge=1, le=MAX_FRAME_PX, title="Rows")]
WindowCols = Annotated[int, Field(ge=1, le=MAX_FRAME_PX, title="Columns")]


class Device(JobModel):
    """The printer or panel that shows the integral image: the pitch of its pixels, and its window."""

    dpi: float | None = Field(default=None, gt=0, le=100_000)
    """The resolution in pixels per inch; a device has either this or `pitch_um`."""
    pitch_um: float | None = Field(default=None, gt=0, le=100_000)
    """The pitch of the pixels in micrometres; a device has either this or `dpi`."""
    margin_px: int = Field(default=0, ge=0, le=MAX_FRAME_PX)
    """The width of the dark margin around the array."""
    window_px: tuple[WindowRows, WindowCols] | None = None
    """The size of the whole picture as (rows, cols), with the array in the middle; this excludes `margin_px`."""

    @model_validator(mode="after")
    def _check_alternatives(self) -> Self:
        if (self.dpi is None) == (self.pitch_um is None):
            raise FieldError("dpi", expected="either this or pitch_um", got="neither" if self.dpi is None else "both")
        if self.window_px is not None and self.margin_px:
            raise FieldError("margin_px", expected="either this or window_px", got="both")
        return self

    @property
    def pixel_mm(self) -> float:
        """The pitch of the pixels, mm."""
        if self.dpi is not None:
            return MM_PER_INCH / self.dpi
        assert self.pitch_um is not None  # noqa: S101 - validated above
        return self.pitch_um / 1000


class Rig(JobModel):
    """The rig: imaging lens, microlens array (MLA), camera and device."""

    imaging_lens: LensChoice | None = "athineos-2006"
    """The imaging lens; null for direct pickup, in which the MLA stands in the space of the scene."""
    f_number: float | None = Field(default=None, gt=0, le=10_000, title="F-number")
    """The f-number that the aperture stop of the imaging lens sets; the stop is fully open if this and `stop_mm` are
    null."""
    stop_mm: float | None = Field(default=None, gt=0, le=10_000)
    """The diameter of the aperture stop."""
    dispersion: bool = False
    """True if glass with an Abbe number disperses light."""
    lens_array: LensArray = LensArray()
    """The microlens array."""
    camera: Camera = Camera()
    """The camera."""
    px_per_lens: int = Field(default=DEFAULT_PX_PER_LENS, ge=MIN_PX_PER_LENS, le=512)
    """The number of pixels across a lens; by default as many as those of the device, if there is one."""
    device: Device | None = None
    """The device that shows the integral image, if it is known."""

    @model_validator(mode="before")
    @classmethod
    def _fill_in_px_per_lens(cls, data: Any) -> Any:
        """Set the default of `px_per_lens`: the number of device pixels across a lens, rounded up."""
        if not isinstance(data, Mapping) or "px_per_lens" in data or not data.get("device"):
            return data
        try:
            array = LensArray.model_validate(data.get("lens_array", {}))
            needed = math.ceil(round(array.pitch_mm / Device.model_validate(data["device"]).pixel_mm, 1))
        except ValueError:
            return data  # The validation of the field itself reports the error.
        step = array.lenses_mm.cell.row_period
        return {**data, "px_per_lens": max(MIN_PX_PER_LENS, -(-needed // step) * step)}

    @model_validator(mode="after")
    def _check_size(self) -> Self:
        longest = max(self.lens_array.count) * self.px_per_lens
        if longest > MAX_FRAME_PX:
            expected = f"count x px_per_lens of at most {MAX_FRAME_PX} px a side"
            raise FieldError("px_per_lens", expected=expected, got=f"{longest} px")
        return self

    @model_validator(mode="after")
    def _check_stop(self) -> Self:
        if self.f_number is not None and self.stop_mm is not None:
            raise FieldError("f_number", expected="either this or stop_mm", got="both")
        if self.imaging_lens is None and (self.f_number is not None or self.stop_mm is not None):
            field = "f_number" if self.f_number is not None else "stop_mm"
            raise FieldError(field, expected="an imaging lens for the stop to stand in", got="imaging_lens null")
        return self

    @model_validator(mode="after")
    def _check_lattice(self) -> Self:
        check_px_per_lens(self.px_per_lens, self.lens_array.lattice)
        return self

    @property
    def layout(self) -> CellLayout:
        """The cell layout of the integral images that the rig captures."""
        array = self.lens_array
        return CellLayout(*array.count, px_per_lens=self.px_per_lens, lattice=array.lattice)


def check_px_per_lens(px_per_lens: int, lattice: Lattice) -> None:
    """Refuse a number of pixels per lens that the lattice does not allow.

    Parameters
    ----------
    px_per_lens
        The number of pixels across a lens.
    lattice
        The kind of the lattice.

    Raises
    ------
    FieldError
        If the number is odd and lens rows are shifted by half a lens.
    """
    if px_per_lens % CELLS[lattice].row_period:
        expected = "an even number on a hexagonal lattice, whose rows are shifted by half a lens"
        raise FieldError("px_per_lens", expected=expected, got=px_per_lens)
