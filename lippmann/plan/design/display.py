"""The display of a design: device, gaps, viewing angle and zone, and the depth that it resolves."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from lippmann.job.optics.rig import Rig
from lippmann.job.scenes.stage import Stage
from lippmann.job.spec import JobSpec
from lippmann.lightfield.sheet.device import device_size
from lippmann.optics.rig import display
from lippmann.optics.rig.array import extent_mm
from lippmann.optics.rig.bench import Bench
from lippmann.plan.design import notes as design_words
from lippmann.plan.design.gaps import gaps
from lippmann.plan.sampling import frame_size


def device_numbers(rig: Rig) -> dict[str, Any]:
    """Return the pixels of the device, or of the rendered image if there is no device."""
    size, device, array = frame_size(rig), rig.device, rig.lens_array
    pixel_mm = device.pixel_mm if device else array.pitch_mm / rig.px_per_lens
    d = array.pitch_mm / pixel_mm
    margin_px = device.margin_px if device else 0
    window = device.window_px if device else None
    rows, cols = device_size(size, px_per_lens_device=d, window=window, margin_px=margin_px)
    array_width_mm, _ = extent_mm(array)
    return {
        "display_pixel_mm": pixel_mm,
        "px_per_lens_device": d,
        "device_cells_px": device_cells_px(array.count[1], cols_px=cols, px_per_lens_device=d),
        "device_rows_px": rows,
        "device_cols_px": cols,
        "margin_px": max(0, (cols - math.floor(array_width_mm / pixel_mm + 0.5)) // 2),
        "width_mm": cols * pixel_mm,
        "height_mm": rows * pixel_mm,
    }


def device_cells_px(lens_cols: int, *, cols_px: int, px_per_lens_device: float) -> tuple[int, ...]:
    """Return the numbers of device columns that lenses have, each number once, in rising order.

    >>> device_cells_px(100, cols_px=2400, px_per_lens_device=600 / 25.4)
    (23, 24)
    """
    edges = cols_px / 2 + (np.arange(lens_cols + 1) - lens_cols / 2) * px_per_lens_device
    # A pixel belongs to the lens over its centre, half a pixel in; on the border itself to the one on the right.
    first = np.ceil(edges - 0.5 - 1e-9)
    return tuple(int(width) for width in np.unique(np.diff(first)))


def display_numbers(spec: JobSpec, optical_bench: Bench, stage: Stage) -> dict[str, Any]:
    """Return gaps, viewing angle and zone, and whether the display resolves the depth of the image."""
    array, distance_mm = spec.rig.lens_array, spec.display.viewing_distance_mm
    f_mm, p_mm = array.focal_length_mm, array.pitch_mm
    near_mm, far_mm = optical_bench.s_mm(stage.near_mm), optical_bench.s_mm(stage.far_mm)
    numbers = _gaps(spec, near_mm=near_mm, far_mm=far_mm)
    in_use = "real" if optical_bench.s_mm(stage.reference_mm) >= 0 else "virtual"
    zone = {"pitch_mm": p_mm, "gap_mm": numbers[f"gap_{in_use}_mm"], "distance_mm": distance_mm}
    pixel_mm = spec.rig.device.pixel_mm if spec.rig.device else p_mm / spec.rig.px_per_lens
    found = display.resolvable_depth_mm(pitch_mm=p_mm, gap_mm=f_mm, pixel_mm=pixel_mm, distance_mm=distance_mm)
    return {
        **numbers,
        "viewing_distance_mm": distance_mm,
        "viewing_angle_deg": numbers[f"viewing_angle_{in_use}_deg"],
        "viewing_zone_mm": display.viewing_zone_mm(**zone),
        "viewing_zone_whole_mm": display.viewing_zone_mm(**zone, apart_mm=extent_mm(array)[0] - p_mm),
        "resolvable_front_mm": found.front_mm,
        "resolvable_back_mm": found.back_mm,
        **design_words.depth_budget(found, near_mm=near_mm, far_mm=far_mm, distance_mm=distance_mm),
    }


def _gaps(spec: JobSpec, *, near_mm: float, far_mm: float) -> dict[str, float]:
    """Return the gaps for real images, for virtual images, and for collimated light."""
    array, numbers = spec.rig.lens_array, {}
    for side, gap in gaps(array, spec.display, near_mm=near_mm, far_mm=far_mm).items():
        numbers[f"gap_{side}_mm"] = gap.reduced_mm
        numbers[f"gap_{side}_physical_mm"] = gap.physical_mm
        numbers[f"viewing_angle_{side}_deg"] = display.viewing_angle_deg(pitch_mm=array.pitch_mm, gap_mm=gap.reduced_mm)
        if side != "collimated":
            plane_mm = display.central_depth_plane_mm(focal_length_mm=array.focal_length_mm, gap_mm=gap.reduced_mm)
            numbers[f"central_depth_plane_{side}_mm"] = plane_mm
    return numbers
