"""The design of a job: the properties of its optics and pixels, as numbers with their units in their names.

Depths `s` count from the array, positive toward the observer. A null means: there is no such thing (direct pickup has
no imaging lens), or no end to it (a plane at infinity, a depth without limit). Names that begin with `exact` come from
the exact trace, those beside them are paraxial. docs/designer.md has every formula.
"""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, ConfigDict

Place = Literal["real", "mixed", "virtual"]


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", use_attribute_docstrings=True)


class PlaneImage(_Part):
    """A plane of the scene with its image by the imaging lens."""

    object_mm: float
    """The distance in front of surface 1."""
    image_mm: float | None
    """The distance of the paraxial image behind the last surface."""
    magnification: float | None
    exact_image_mm: float | None
    """The place of the smallest spot of the axis point, for the rays that reach the array; null if none do."""
    exact_magnification: float | None
    """The magnification of the point that is imaged to the edge of the array, by the middle of its spot."""


class Conjugates(_Part):
    """The three planes of a stage."""

    near: PlaneImage
    reference: PlaneImage
    far: PlaneImage


class AxisCrossing(_Part):
    """The place where an exact ray from the axis crosses it again: spherical aberration."""

    object_mm: float
    height_mm: float
    """The height of the ray at the vertex plane of surface 1."""
    image_mm: float | None
    """The distance behind the last surface, with open apertures."""
    aberration_mm: float | None
    """The difference from the paraxial image."""


class LensDesign(_Part):
    """The imaging lens; all values are null in direct pickup. Touching surfaces are calculated as touching."""

    imaging_lens: str | None
    efl_mm: float | None
    """The effective focal length of the imaging lens."""
    back_focal_distance_mm: float | None
    front_focal_distance_mm: float | None
    """The distance from surface 1, positive behind it."""
    f_number: float | None
    """The f-number for a distant object, at the set aperture."""
    working_f_number: float | None
    """The f-number of the cone of rays to the image of the reference plane's axis point, by the exact trace."""
    lens_length_mm: float | None
    conjugates: Conjugates | None
    image_near_mm: float | None
    image_reference_mm: float | None
    image_far_mm: float | None
    image_depth_mm: float | None
    """The depth of the image of the scene, from the near plane's to the far plane's."""
    depth_compression: float | None
    mean_magnification: float | None
    """The mean of the absolute values at near and far."""
    exact_image_near_mm: float | None
    exact_image_reference_mm: float | None
    exact_image_far_mm: float | None
    exact_image_depth_mm: float | None
    exact_depth_compression: float | None
    exact_mean_magnification: float | None
    axis_crossings: tuple[AxisCrossing, ...]
    spot_near_mm: float | None
    """The RMS radius of the image of the axis point, on its exact image plane."""
    spot_reference_mm: float | None
    spot_far_mm: float | None
    spot_near_edge_mm: float | None
    """The RMS radius for the point that is imaged to the edge of the array, on the same plane."""
    spot_reference_edge_mm: float | None
    spot_far_edge_mm: float | None


class CaptureDesign(_Part):
    """The lens array, the camera and the pixels."""

    lens_radius_mm: float
    displacement_mm: float
    """The distance from the centre of the sphere to the flat side."""
    lens_thickness_mm: float
    mla_f_number: float
    """The focal length of a microlens divided by the pitch; the imaging lens should match it."""
    f_number_match: str | None
    mla_behind_lens_mm: float | None
    """The distance from the last surface of the imaging lens to the array."""
    mla_place: Place
    mla_place_words: str
    s_near_mm: float | None
    """The depth at which the near plane is shown, positive in front of the display."""
    s_reference_mm: float | None
    s_far_mm: float | None
    """The depth at which the far plane is shown, positive in front of the display."""
    exact_s_near_mm: float | None
    """The depth of the exact image; in direct pickup, of the object itself."""
    exact_s_reference_mm: float | None
    exact_s_far_mm: float | None
    disparity_near: float | None
    """The paraxial disparity of the near plane between neighbouring views, in lenses."""
    disparity_far: float | None
    exact_disparity_near: float | None
    exact_disparity_far: float | None
    projection: Literal["orthographic", "perspective"]
    camera_distance_mm: float
    """The distance from the array to a perspective camera of this angle, for any projection of the job."""
    camera_angle_deg: float
    rows_px: int
    """The height of the integral image."""
    cols_px: int
    """The width of the integral image."""
    lens_rows: int
    lens_cols: int
    px_per_lens: int
    views: int
    """The number of views, one for each pixel under a lens."""
    view_rows_px: int
    """The height of a view, one pixel a lens."""
    view_cols_px: int
    """The width of a view, one pixel a lens."""
    capture_method: Literal["glass", "ray_camera"]


class DisplayDesign(_Part):
    """The display, a print or panel, and its observer."""

    display_pixel_mm: float
    """The pixel of the device, or pitch / px_per_lens without a device."""
    px_per_lens_device: float
    device_cells_px: tuple[int, ...]
    """The widths of cells on the device: one if all are equal, otherwise the two that alternate."""
    device_rows_px: int
    device_cols_px: int
    margin_px: int
    """The dark pixels on the left and on the right of the array."""
    width_mm: float
    """The size of the print or of the shown picture, including margins."""
    height_mm: float
    viewing_distance_mm: float
    gap_real_mm: float
    """The reduced gap, in which glass counts by its index."""
    gap_virtual_mm: float
    gap_collimated_mm: float
    gap_real_physical_mm: float
    """The gap as built, including the substrate."""
    gap_virtual_physical_mm: float
    """The gap as built for images behind the display."""
    gap_collimated_physical_mm: float
    central_depth_plane_real_mm: float | None
    central_depth_plane_virtual_mm: float | None
    viewing_angle_deg: float
    """The value at the gap in use: that for real images if the reference plane is in front, otherwise for virtual
    images."""
    viewing_angle_real_deg: float
    viewing_angle_virtual_deg: float
    viewing_angle_collimated_deg: float
    viewing_zone_mm: float
    """The width at the viewing distance in which one lens shows its own cell, at the gap in use."""
    viewing_zone_whole_mm: float
    """The width in which all lenses show their own cells."""
    resolvable_front_mm: float
    """The value at the gap for collimated light."""
    resolvable_back_mm: float | None
    depth_budget: Literal["fits", "exceeded"]
    depth_budget_words: str


class CostDesign(_Part):
    """Estimates of time and memory."""

    frames: int
    sheet_mb: float
    """The size of a frame's integral image in memory."""
    memory_mb: float
    """The memory that a worker needs for a frame."""
    frame_cpu_s: float
    """The estimated processor time of a frame, before the probe has measured it."""
    cpu_s: float
    """The estimated processor time of all frames."""
    measured_on: str


class Subject(_Part):
    """The job that is designed."""

    scene: str
    title: str
    frame: int


# The fields have the order of the light: pydantic takes the bases from the last one to the first.
class Design(CostDesign, DisplayDesign, CaptureDesign, LensDesign, Subject):
    """The design of a job at one frame."""

    warnings: tuple[str, ...]
