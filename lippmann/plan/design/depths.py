"""The depths at which a display shows the scene, and the range of depths that is worth refocusing."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from lippmann.job.optics.rig import Rig
from lippmann.job.scenes.stage import Stage
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.refocus.shift_and_sum import shifts
from lippmann.optics.rig.sharp_depth import sharp_depth_mm, view_offsets_mm
from lippmann.plan.design.designer import bench_as_written
from lippmann.plan.sampling import display_size

ROOM = 0.25
"""The margin in front of and behind the scene, as a share of its depth."""
LEAST_ROOM_FOCAL_LENGTHS = 3.0
"""The least margin, in focal lengths: the depth of focus is about one focal length."""

SHARE_OF_REACH = 0.25
"""The share of the depths at which all views overlap that is used if the scene's depths are unknown."""


@dataclass(frozen=True)
class ShownDepths:
    """Depths of a display whose array is one focal length in front of its pixels.

    They are those at which the refocused picture of a point on the axis is sharpest, by exact rays; where the rays
    have none, paraxial.
    """

    near_mm: float | None
    """The depth of the near plane of the stage; infinite if its image is; None without a stage."""
    reference_mm: float | None
    far_mm: float | None
    from_mm: float
    to_mm: float
    """The range of depths that is worth refocusing."""
    lenses_per_mm: tuple[float, float]
    """The disparity between neighbouring views per mm of depth, (across, down), in pitches."""


def shown_depths(rig: Rig, stage: Stage | None) -> ShownDepths:
    """Return the depths of a stage's planes on a display, and the range in which the outermost views overlap.

    Imported pictures have no stage.

    Raises
    ------
    OpticsError, SpecError
        If the rig cannot be built.
    """
    layout, focal_mm = display_size(rig), rig.lens_array.focal_length_mm
    down, across = shifts(layout, 1.0, focal_mm=focal_mm)
    reach_mm = _reach_mm(layout, (down, across))
    planes_mm = () if stage is None else _planes_mm(rig, stage, layout)
    near_mm, reference_mm, far_mm = planes_mm or (None, None, None)
    ends_mm = [0.0, *filter(math.isfinite, planes_mm)]
    least_mm = LEAST_ROOM_FOCAL_LENGTHS * focal_mm
    if not planes_mm and math.isfinite(reach_mm):
        least_mm = max(least_mm, SHARE_OF_REACH * reach_mm)
    room_mm = max(ROOM * (max(ends_mm) - min(ends_mm)), least_mm)
    return ShownDepths(
        near_mm=near_mm,
        reference_mm=reference_mm,
        far_mm=far_mm,
        from_mm=max(min(ends_mm) - room_mm, -reach_mm),
        to_mm=min(max(ends_mm) + room_mm, reach_mm),
        lenses_per_mm=(across, down),
    )


def _planes_mm(rig: Rig, stage: Stage, layout: CellLayout) -> tuple[float, ...]:
    optical_bench = bench_as_written(rig, stage)
    planes_mm = (stage.near_mm, stage.reference_mm, stage.far_mm)
    points_mm = np.array([(0.0, 0.0, -plane_mm) for plane_mm in planes_mm])
    exact_mm = sharp_depth_mm(optical_bench, points_mm, view_offsets_mm(rig, layout))
    # A point at s for the array of the capture is shown at s + f in the paraxial approximation (docs/optics.md, Depth).
    paraxial_mm = [optical_bench.s_mm(plane_mm) + rig.lens_array.focal_length_mm for plane_mm in planes_mm]
    return tuple(
        float(exact) if math.isfinite(exact) else paraxial
        for exact, paraxial in zip(exact_mm, paraxial_mm, strict=True)
    )


def _reach_mm(layout: CellLayout, lenses_per_mm: tuple[float, float]) -> float:
    """Return the depth up to which the outermost views overlap by at least one lens."""
    axes = zip(layout.square_size(), (layout.cell_rows, layout.cell_cols), lenses_per_mm, strict=True)
    reaches = [(lenses - 1) / ((views - 1) * step) for lenses, views, step in axes if views > 1]
    return min(reaches, default=math.inf)
