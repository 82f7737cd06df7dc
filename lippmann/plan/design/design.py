"""A design: everything that a job's optics and pixels will give, as numbers with their units in their names.

Depths `s` count from the array, positive toward the observer. A null means: there is no such thing (direct pickup has
no imaging lens), or no end to it (a plane at infinity, a depth without limit). Names that begin with `exact` come from
the exact trace, those beside them from the law of small angles. docs/designer.md has every formula.
"""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, ConfigDict

Place = Literal["real", "mixed", "virtual"]


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", use_attribute_docstrings=True)


class PlaneImage(_Part):
    """A plane of the scene and its image by the imaging lens."""

    object_mm: float
    """Before surface 1."""
    image_mm: float | None
    """Behind the last surface (paraxial)."""
    magnification: float | None
    exact_image_mm: float | None
    """Where the spot of the axis point is smallest, of the rays that the array takes; null where none arrive."""
    exact_magnification: float | None
    """Of the point that is imaged to the edge of the array: middle of its spot there."""


class Conjugates(_Part):
    """The three planes that a stage names."""

    near: PlaneImage
    reference: PlaneImage
    far: PlaneImage


class AxisCrossing(_Part):
    """Where one exact ray from the axis crosses it again: spherical aberration."""

    object_mm: float
    height_mm: float
    """Of the ray on the plane of surface 1's vertex."""
    image_mm: float | None
    """Behind the last surface, apertures open."""
    aberration_mm: float | None
    """Against the paraxial image."""


class LensDesign(_Part):
    """What the imaging lens does; all null in direct pickup. Surfaces that touch are reckoned as touching."""

    imaging_lens: str | None
    efl_mm: float | None
    back_focal_distance_mm: float | None
    front_focal_distance_mm: float | None
    """From surface 1, positive behind it."""
    f_number: float | None
    """For a distant object, of the aperture as set."""
    working_f_number: float | None
    """Of the cone that comes together in the image of the reference plane's axis point, by the exact trace."""
    lens_length_mm: float | None
    conjugates: Conjugates | None
    image_near_mm: float | None
    image_reference_mm: float | None
    image_far_mm: float | None
    image_depth_mm: float | None
    depth_compression: float | None
    mean_magnification: float | None
    """Mean of the absolute values at near and far."""
    exact_image_near_mm: float | None
    exact_image_reference_mm: float | None
    exact_image_far_mm: float | None
    exact_image_depth_mm: float | None
    exact_depth_compression: float | None
    exact_mean_magnification: float | None
    axis_crossings: tuple[AxisCrossing, ...]
    spot_near_mm: float | None
    """RMS radius of the image of the axis point, on its exact image plane."""
    spot_reference_mm: float | None
    spot_far_mm: float | None
    spot_near_edge_mm: float | None
    """The same of the point that is imaged to the edge of the array, on the same plane."""
    spot_reference_edge_mm: float | None
    spot_far_edge_mm: float | None


class CaptureDesign(_Part):
    """Array, camera and pixels."""

    lens_radius_mm: float
    displacement_mm: float
    """From the sphere's centre to the flat side."""
    lens_thickness_mm: float
    mla_f_number: float
    f_number_match: str | None
    mla_behind_lens_mm: float | None
    mla_place: Place
    mla_place_words: str
    s_near_mm: float | None
    s_reference_mm: float | None
    s_far_mm: float | None
    exact_s_near_mm: float | None
    """By the exact image; in direct pickup there is none but the thing itself."""
    exact_s_reference_mm: float | None
    exact_s_far_mm: float | None
    disparity_near: float | None
    """Lenses that the near plane moves from one view to the next (small angles)."""
    disparity_far: float | None
    exact_disparity_near: float | None
    exact_disparity_far: float | None
    projection: Literal["orthographic", "perspective"]
    camera_distance_mm: float
    """From the array to a perspective camera of this angle, whether or not the camera is one."""
    camera_angle_deg: float
    rows_px: int
    cols_px: int
    lens_rows: int
    lens_cols: int
    px_per_lens: int
    views: int
    view_rows_px: int
    view_cols_px: int
    capture_method: Literal["glass", "ray_camera"]


class DisplayDesign(_Part):
    """The print or panel, and who looks at it."""

    display_pixel_mm: float
    """The device's, or pitch / px_per_lens without one."""
    px_per_lens_device: float
    device_cells_px: tuple[int, ...]
    """Widths of cells on the device: one if they are all the same, else the two that alternate."""
    device_rows_px: int
    device_cols_px: int
    margin_px: int
    """Dark pixels at the left and at the right of the array."""
    width_mm: float
    """Of what is printed or shown, margins included."""
    height_mm: float
    viewing_distance_mm: float
    gap_real_mm: float
    """Reduced: glass by its index."""
    gap_virtual_mm: float
    gap_collimated_mm: float
    gap_real_physical_mm: float
    """As built, substrate included."""
    gap_virtual_physical_mm: float
    gap_collimated_physical_mm: float
    central_depth_plane_real_mm: float | None
    central_depth_plane_virtual_mm: float | None
    viewing_angle_deg: float
    """At the gap in use: the real one if the reference plane is shown before the display, else the virtual one."""
    viewing_angle_real_deg: float
    viewing_angle_virtual_deg: float
    viewing_angle_collimated_deg: float
    viewing_zone_mm: float
    """Width at the viewing distance in which one lens shows its own cell, at the gap in use."""
    viewing_zone_whole_mm: float
    """Width in which all lenses do."""
    resolvable_front_mm: float
    """At the collimated gap."""
    resolvable_back_mm: float | None
    depth_budget: Literal["fits", "exceeded"]
    depth_budget_words: str


class CostDesign(_Part):
    """Estimates."""

    frames: int
    sheet_mb: float
    memory_mb: float
    frame_cpu_s: float
    cpu_s: float
    measured_on: str


class Subject(_Part):
    """What is designed."""

    scene: str
    title: str
    frame: int


# Fields stand in the order of the light: pydantic takes the bases from the last one to the first.
class Design(CostDesign, DisplayDesign, CaptureDesign, LensDesign, Subject):
    """A job's design at one frame."""

    warnings: tuple[str, ...]
