"""Looking into a frame: what can be seen of it, and how that is asked for."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from lippmann.job.viewing import EYES_APART_MM, PUPIL_MM, Filter, GapUse, Stereo
from service.schemas.answer import Answer

Depth = Annotated[float, Field(ge=-1e6, le=1e6)]
Place = Annotated[float, Field(ge=-1e6, le=1e6)]


class AtlasPlan(Answer):
    """How views lie in `views.atlas`: view (us[i], vs[j]) at grid column i and grid row j."""

    url: str
    us: tuple[int, ...]
    vs: tuple[int, ...]
    rows: int
    """Height of the whole picture, px."""
    cols: int
    """Width of the whole picture, px."""


class Depths(Answer):
    """Depths of the display, positive in front of it, as `refocus` takes them; by the law of small angles."""

    near_mm: float | None
    """Of the nearest thing in the scene that should come out sharp; null at infinity or of sheets from elsewhere, of
    which nobody knows; as below."""
    reference_mm: float | None
    far_mm: float | None
    from_mm: float
    """The range worth looking through: what the scene holds, with some room, while the outermost views overlap."""
    to_mm: float
    lenses_per_mm: tuple[float, float]
    """How far a point at a depth moves from one view to the next, for every millimetre of it: (across, down), in
    pixels of a view, against the eye. Down differs on the hexagonal lattice only."""


class Look(Answer):
    """What a frame shows to those who look into it."""

    frame: int
    lattice: Literal["square", "hexagonal"]
    lens_rows: int
    lens_cols: int
    view_rows: int
    """Height of a view on square pixels, px."""
    view_cols: int
    """Width of a view, px."""
    us: int
    """Views from left to right: u from 0, rising as the eye moves to the right."""
    vs: int
    """Views from top to bottom: v from 0, rising as the eye moves down."""
    missing: tuple[tuple[int, int], ...]
    """Views (u, v) that a hexagonal lens does not have."""
    centre: tuple[int, int]
    """The (u, v) of the view in the middle."""
    pitch_mm: float
    """Of the lenses."""
    gap_mm: float
    """From the pixels to the lenses: their focal length, which all depths here are reckoned with."""
    viewing_distance_mm: float
    """Where the job's viewer stands."""
    depths: Depths
    atlas: AtlasPlan


class _Asked(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, use_attribute_docstrings=True)


class _Pictured(_Asked):
    format: Literal["png", "webp"] = "png"
    """WebP is lossy."""


class _FromAPlace(_Pictured):
    x: Place = 0.0
    """Of the eye, or of the middle between two, mm from the middle of the display: to the right."""
    y: Place = 0.0
    """Upward."""
    z: float | None = None
    """In front; the job's viewing distance when not said."""


class Shown(_Pictured):
    """How a picture is to come that has one pixel a lens."""

    scale: int = Field(default=1, ge=1, le=32)
    """How many times larger, each way."""
    filter: Filter = "lanczos3"
    """By which filter, in linear light."""


class ViewQuery(Shown):
    """One view; the one in the middle when neither is said."""

    u: int | None = None
    v: int | None = None


class PerspectiveQuery(Shown, _FromAPlace):
    """Where an eye stands."""


class RefocusQuery(Shown):
    """Which depth is to be sharp."""

    depth_mm: Depth
    """Positive in front of the display."""


class ObserverQuery(_FromAPlace):
    """Where an observer stands, with which eyes, before which gap."""

    gap: GapUse | None = None
    """The gap that the design chooses for images of this kind."""
    gap_mm: float | None = Field(default=None, gt=0, le=10_000)
    """Or the gap itself, reduced; one focal length when neither is said."""
    pupil_mm: float = Field(default=PUPIL_MM, gt=0, le=100)
    """Diameter of the pupil."""
    focus_mm: Depth = 0.0
    """The depth that the eye focuses on, positive in front of the display."""
    stereo: Stereo | None = None
    """How two eyes' pictures come together; one eye when not said."""
    eye_distance_mm: float = Field(default=EYES_APART_MM, gt=0, le=1000)
    """Between two eyes."""
    rays: int = Field(default=16, ge=1, le=256)
    """Through the pupil, for every pixel: more take longer."""
    size: int = Field(default=360, ge=16, le=2048)
    """Longer side of an eye's picture, px."""


class AtlasQuery(_Pictured):
    """How large a picture a graphics card takes."""

    max_px: int = Field(default=4096, ge=16, le=16_384)
    """The longest side of the atlas; of views that do not all fit, evenly spread ones are taken."""
