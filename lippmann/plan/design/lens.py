"""The imaging lens of a design: conjugates, exact images, spots and spherical aberration."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from lippmann.job.scenes.stage import Stage
from lippmann.optics.lens.matrices import cardinal_points, conjugate
from lippmann.optics.lens.stop import f_number
from lippmann.optics.lens.surfaces import ImagingLens
from lippmann.optics.lens.trace import axis_crossing_mm
from lippmann.optics.rig.bench import Bench
from lippmann.optics.rig.spots import Focus, best_focus, focus_at, working_f_number
from lippmann.plan.design.design import AxisCrossing, Conjugates, PlaneImage

CROSSING_PARTS = (0.1, 0.4, 0.5, 1.0)
"""Heights of single rays, in semi-apertures of surface 1: 10, 40, 50 and 100 mm on the paper's lens."""


def ended(value: Any) -> Any:
    """Return None for an infinite length or magnification, because JSON has no infinity."""
    return None if isinstance(value, float) and not math.isfinite(value) else value


@dataclass(frozen=True)
class _Traced:
    """A plane of the stage with its exact image."""

    plane: PlaneImage
    axis: Focus | None
    edge: Focus | None


def _traced(optical_bench: Bench, object_mm: float) -> _Traced:
    lens = _present(optical_bench.imaging_lens)
    paraxial = conjugate(lens, object_mm)
    axis = _sharp(best_focus(optical_bench, object_mm))
    # As the scene's image is inverted, the point below the axis is imaged to the array's upper edge.
    array = optical_bench.rig.lens_array
    image_mm = array.lenses_mm.span[0] / 2
    # An image without any size, of what is too far away, has no point that is imaged to the edge.
    edge_mm = image_mm / paraxial.magnification if paraxial.magnification else 0.0
    edge = (
        _sharp(focus_at(optical_bench, object_mm, height_mm=edge_mm, image_mm=axis.image_mm))
        if axis and edge_mm
        else None
    )
    plane = PlaneImage(
        object_mm=object_mm,
        image_mm=ended(paraxial.image_mm),
        magnification=ended(paraxial.magnification),
        exact_image_mm=axis and axis.image_mm,
        exact_magnification=ended(edge.height_mm / edge_mm) if edge else None,
    )
    return _Traced(plane, axis, edge)


def _sharp(focus: Focus | None) -> Focus | None:
    """Return a focus, or None for rays that do not meet."""
    if focus is None or not all(map(math.isfinite, (focus.image_mm, focus.rms_mm, focus.height_mm))):
        return None
    return focus


def _present(lens: ImagingLens | None) -> ImagingLens:
    if lens is None:
        raise ValueError("expected an imaging lens, got direct pickup")
    return lens


_NO_LENS: dict[str, Any] = dict.fromkeys(
    (
        *("imaging_lens", "efl_mm", "back_focal_distance_mm", "front_focal_distance_mm", "f_number"),
        *("working_f_number", "lens_length_mm", "conjugates", "image_near_mm", "image_reference_mm", "image_far_mm"),
        *("image_depth_mm", "depth_compression", "mean_magnification", "exact_image_near_mm"),
        *("exact_image_reference_mm", "exact_image_far_mm", "exact_image_depth_mm", "exact_depth_compression"),
        *("exact_mean_magnification", "spot_near_mm", "spot_reference_mm", "spot_far_mm"),
        *("spot_near_edge_mm", "spot_reference_edge_mm", "spot_far_edge_mm"),
        *("exact_s_near_mm", "exact_s_reference_mm", "exact_s_far_mm"),
    )
) | {"axis_crossings": ()}


def lens_numbers(optical_bench: Bench, stage: Stage) -> dict[str, Any]:
    """Return the design of the imaging lens, and the depths of the exact images."""
    lens = optical_bench.imaging_lens
    if lens is None:
        return _NO_LENS
    points = cardinal_points(lens)
    planes = {"near": stage.near_mm, "reference": stage.reference_mm, "far": stage.far_mm}
    traced = {name: _traced(optical_bench, object_mm) for name, object_mm in planes.items()}
    numbers = {
        "imaging_lens": lens.title or lens.name or "own prescription",
        "efl_mm": points.effective_focal_length_mm,
        "back_focal_distance_mm": points.back_focal_distance_mm,
        "front_focal_distance_mm": points.front_focal_distance_mm,
        "f_number": f_number(lens),
        "working_f_number": working_f_number(optical_bench, stage.reference_mm),
        "lens_length_mm": lens.length_mm,
        "conjugates": Conjugates(**{name: one.plane for name, one in traced.items()}),
        "axis_crossings": _crossings(lens, sorted(set(planes.values()))),
    }
    for name, one in traced.items():
        exact_mm = one.plane.exact_image_mm
        numbers[f"image_{name}_mm"] = one.plane.image_mm
        numbers[f"exact_image_{name}_mm"] = exact_mm
        numbers[f"exact_s_{name}_mm"] = None if exact_mm is None else exact_mm - optical_bench.mla_behind_lens_mm
        numbers[f"spot_{name}_mm"] = one.axis and one.axis.rms_mm
        numbers[f"spot_{name}_edge_mm"] = one.edge and one.edge.rms_mm
    return numbers | _depths(traced["near"].plane, traced["far"].plane)


def _depths(near: PlaneImage, far: PlaneImage) -> dict[str, float | None]:
    """Return the depth of the image and its ratio to the depth of the scene, paraxial and exact."""
    scene_mm = far.object_mm - near.object_mm
    depth_mm = _difference(near.image_mm, far.image_mm)
    exact_depth_mm = _difference(near.exact_image_mm, far.exact_image_mm)
    return {
        "image_depth_mm": depth_mm,
        "depth_compression": scene_mm / depth_mm if depth_mm else None,
        "mean_magnification": _mean_size(near.magnification, far.magnification),
        "exact_image_depth_mm": exact_depth_mm,
        "exact_depth_compression": scene_mm / exact_depth_mm if exact_depth_mm else None,
        "exact_mean_magnification": _mean_size(near.exact_magnification, far.exact_magnification),
    }


def _difference(left: float | None, right: float | None) -> float | None:
    return None if left is None or right is None else left - right


def _mean_size(near: float | None, far: float | None) -> float | None:
    return None if near is None or far is None else (abs(near) + abs(far)) / 2


def _crossings(lens: ImagingLens, planes_mm: list[float]) -> tuple[AxisCrossing, ...]:
    found = []
    for object_mm in planes_mm:
        paraxial_mm = conjugate(lens, object_mm).image_mm
        for part in CROSSING_PARTS:
            height_mm = part * lens.surfaces[0].semi_aperture_mm
            image_mm = axis_crossing_mm(lens, object_mm=object_mm, height_mm=height_mm)
            if math.isfinite(image_mm):
                found.append(
                    AxisCrossing(
                        object_mm=object_mm,
                        height_mm=height_mm,
                        image_mm=image_mm,
                        aberration_mm=ended(image_mm - paraxial_mm),
                    )
                )
    return tuple(found)
