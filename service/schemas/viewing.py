"""Views of a frame on demand, and the queries for them."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from lippmann.job.optics.viewing import EYES_APART_MM, PUPIL_MM, Filter, GapUse, PictureFormat, Stereo
from service.schemas.answer import Answer

Depth = Annotated[float, Field(ge=-1e6, le=1e6)]
Place = Annotated[float, Field(ge=-1e6, le=1e6)]


class AtlasPlan(Answer):
    """The arrangement of the views in `views.atlas`: view (us[i], vs[j]) is in grid column i and grid row j."""

    url: str
    us: tuple[int, ...]
    vs: tuple[int, ...]
    rows: int
    """Height of the whole picture in pixels."""
    cols: int
    """Width of the whole picture in pixels."""


DepthSource = Literal["truth", "estimate"]
"""The origin of a depth: `truth` is the renderer's, by exact rays (`capture.depth`); `estimate` is of the pictures."""


class DepthMapPlan(Answer):
    """The depth map of the central view: its URL and its origin."""

    url: str
    source: DepthSource


class FocusDepth(Answer):
    """The depth to which to refocus, so that what a view shows at a place is sharp."""

    depth_mm: float | None
    """The depth in mm, positive in front of the display, as `refocus` takes it; null where the picture is uniform."""
    source: DepthSource
    scene_mm: float | None
    """The distance in the scene, along the axis, from the first surface of the imaging lens or from the origin of the
    rig to the surface; null if it is unknown."""


class Depths(Answer):
    """Depths of the display in mm, positive in front of it, as `refocus` takes them.

    The depths of the scene are those at which the refocused picture of a point on the axis is sharpest, by exact rays.
    They differ from paraxial ones by the spherical aberration of the imaging lens.
    """

    near_mm: float | None
    """The depth of the nearest object of the scene that should be sharp; null at infinity or for imported sheets."""
    reference_mm: float | None
    """The depth of the reference plane of the scene; null at infinity or for imported sheets."""
    far_mm: float | None
    """The depth of the farthest object of the scene that should be sharp; null at infinity or for imported sheets."""
    from_mm: float
    """The lower end of the useful range: the depth of the scene with a margin, as long as the outermost views
    overlap."""
    to_mm: float
    """The upper end of the useful range."""
    lenses_per_mm: tuple[float, float]
    """The disparity between neighbouring views per mm of depth, in pixels of a view, as (across, down). A point in
    front of the display moves against the eye. The second number is not 0 only on the hexagonal lattice."""


class FrameViews(Answer):
    """The views of a frame, its depths, and how to request them."""

    frame: int
    lattice: Literal["square", "hexagonal"]
    lens_rows: int
    lens_cols: int
    view_rows: int
    """Height of a view on square pixels, in pixels."""
    view_cols: int
    """Width of a view in pixels."""
    us: int
    """The number of views from left to right: u runs from 0 and rises as the eye moves to the right."""
    vs: int
    """The number of views from top to bottom: v runs from 0 and rises as the eye moves down."""
    missing: tuple[tuple[int, int], ...]
    """The views (u, v) that a hexagonal lens does not have."""
    centre: tuple[int, int]
    """The (u, v) of the central view."""
    pitch_mm: float
    """The pitch of the lenses."""
    gap_mm: float
    """The distance from the pixels to the lenses. It is the focal length, with which all depths here are computed."""
    viewing_distance_mm: float
    """The viewing distance of the job's display."""
    depths: Depths
    atlas: AtlasPlan
    first_atlas: AtlasPlan
    """A small atlas for a first picture: at most 540 px wide and high, unless one view is larger."""
    depth_map: DepthMapPlan


class _Query(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, use_attribute_docstrings=True)


class _PictureQuery(_Query):
    format: PictureFormat = "png"
    """The format of the picture: PNG and WebP have sRGB codes of 8 bits, and WebP is lossy; EXR has linear light."""


class _EyeQuery(_PictureQuery):
    x: Place = 0.0
    """The position of the eye, or of the middle between two eyes: mm to the right of the centre of the display."""
    y: Place = 0.0
    """The position of the eye: mm above the centre of the display."""
    z: float | None = None
    """The position of the eye: mm in front of the display, by default the viewing distance of the job."""


class ScaledQuery(_PictureQuery):
    """The size of a picture with one pixel per lens."""

    scale: int = Field(default=1, ge=1, le=32)
    """The factor by which the picture is enlarged in both directions."""
    filter: Filter = "lanczos3"
    """The filter of the enlargement, which works in linear light."""


class ViewQuery(ScaledQuery):
    """The number of a view; by default the central one."""

    u: int | None = None
    v: int | None = None


class DepthMapQuery(_Query):
    """The number of the view whose depth is wanted; by default the central one."""

    u: int | None = None
    v: int | None = None


class FocusQuery(DepthMapQuery):
    """A place in a view, or in a refocused picture, which shows things where the central view does."""

    x: float = Field(ge=0, le=1)
    """The place, as a part of the width from the left."""
    y: float = Field(ge=0, le=1)
    """The place, as a part of the height from the top."""


class PerspectiveQuery(ScaledQuery, _EyeQuery):
    """The position of an eye."""


class RefocusQuery(ScaledQuery):
    """The depth at which the picture is sharp."""

    depth_mm: Depth
    """The depth in mm, positive in front of the display."""


class ObserverQuery(_EyeQuery):
    """The position and the eyes of an observer, and the gap of the display."""

    gap: GapUse | None = None
    """The gap that the design chooses for this use."""
    gap_mm: float | None = Field(default=None, gt=0, le=10_000)
    """The gap itself, as a reduced distance; by default one focal length."""
    pupil_mm: float = Field(default=PUPIL_MM, gt=0, le=100)
    """The diameter of the pupil."""
    focus_mm: Depth = 0.0
    """The depth on which the eye focuses, positive in front of the display."""
    stereo: Stereo | None = None
    """The arrangement of the pictures of two eyes; by default there is one eye."""
    eye_distance_mm: float = Field(default=EYES_APART_MM, gt=0, le=1000)
    """The distance between the two eyes."""
    rays: int = Field(default=16, ge=1, le=256)
    """The number of rays through the pupil for each pixel. More rays take longer."""
    size: int = Field(default=360, ge=16, le=2048)
    """The longer side of the picture of one eye, in pixels."""


class AtlasQuery(_Query):
    """The largest picture that a graphics card takes."""

    format: Literal["png", "webp"] = "png"
    """The format of the picture. WebP is lossy."""
    max_px: int = Field(default=4096, ge=16, le=16_384)
    """The longest side of the atlas. If not all views fit, evenly spaced ones are taken."""
