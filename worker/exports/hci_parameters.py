"""`parameters.cfg` of the HCI 4D light field benchmark: the cameras of a light field.

Honauer, Johannsen, Kondermann, Goldluecke, *A dataset and evaluation methodology for depth estimation on 4D light
fields*, ACCV 2016. Sections and keys are those of the benchmark's own scenes; its tools compute, with `depth` Z and
`focus_distance_m` F in metres, the disparity in pixels per camera,

    disparity = (baseline_mm / 1000) focal_length_mm max(image_resolution) (1 / Z - 1 / F) / sensor_size_mm.

Our views are parallel projections: cameras infinitely far off. They are described as cameras at the distance
`DISTANCE_MM` = D in front of the display that look at a window of it, in which a pixel is one lens pitch p wide: the
focal length is D, the sensor W p (W is the longer side in pixels), and the focus distance D. From one view to the next
the eye moves by the baseline D P / g, where P is the pixel and g the gap. A point at s then has Z = D - s and

    disparity = (P s) / (g p) D / (D - s),

which is the paraxial disparity s / (n f), except for the factor D / (D - s): 1.0004 at 40 mm. The point clouds of the
tools show the volume of the display in metres, with the same factor.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from configparser import ConfigParser
from dataclasses import dataclass
from io import StringIO
from typing import Any

import numpy as np
from numpy.typing import NDArray

DISTANCE_MM = 1e5
"""The distance of the cameras from the display. Farther cameras would be more nearly parallel, but depths from the
cameras in single precision would be coarser: they are 0.008 mm here."""


@dataclass(frozen=True)
class Cameras:
    """The cameras of a light field, as `parameters.cfg` describes them."""

    rows_px: int
    cols_px: int
    """The size of a view."""
    views_down: int
    views_across: int
    pitch_mm: float
    """The distance on the display between neighbouring pixels of a view."""
    pixel_mm: float
    """The distance on the display between neighbouring views."""
    gap_mm: float
    scene: str
    category: str
    version: str
    disparities: tuple[float, float]
    """The least and the greatest disparity; both are 0 where it is unknown."""

    @property
    def baseline_mm(self) -> float:
        """The distance between neighbouring cameras."""
        return DISTANCE_MM * self.pixel_mm / self.gap_mm

    @property
    def sensor_mm(self) -> float:
        """The longer side of the sensor."""
        return max(self.rows_px, self.cols_px) * self.pitch_mm

    def depth_m(self, disparity: NDArray[np.floating[Any]]) -> NDArray[np.float64]:
        """Return the depths that the benchmark's tools compute from disparities."""
        factor = self.baseline_mm / 1000 * DISTANCE_MM / self.pitch_mm
        depth: NDArray[np.float64] = 1 / (disparity.astype(np.float64) / factor + 1000 / DISTANCE_MM)
        return depth


def disparity_range(maps: Iterable[NDArray[np.floating[Any]]]) -> tuple[float, float]:
    """Return (disp_min, disp_max) as the benchmark's add-on does: rounded outward to a tenth, plus a tenth.

    The result is (0, 0) if there are no maps, or only NaN in them.
    """
    known = [found[np.isfinite(found)] for found in maps]
    ends = [(float(found.min()), float(found.max())) for found in known if found.size]
    if not ends:
        return 0.0, 0.0
    lowest, highest = min(low for low, _ in ends), max(high for _, high in ends)
    return round(math.floor(lowest * 10) / 10 - 0.1, 1), round(math.ceil(highest * 10) / 10 + 0.1, 1)


def parameters_cfg(cameras: Cameras) -> str:
    """Return the text of `parameters.cfg`."""
    parser = ConfigParser(delimiters="=", interpolation=None)
    parser["intrinsics"] = {
        "focal_length_mm": _number(DISTANCE_MM),
        "image_resolution_x_px": str(cameras.cols_px),
        "image_resolution_y_px": str(cameras.rows_px),
        "sensor_size_mm": _number(cameras.sensor_mm),
        "fstop": "inf",
    }
    parser["extrinsics"] = {
        "num_cams_x": str(cameras.views_across),
        "num_cams_y": str(cameras.views_down),
        "baseline_mm": _number(cameras.baseline_mm),
        "focus_distance_m": _number(DISTANCE_MM / 1000),
        **{f"center_cam_{name}": "0.0" for name in ("x_m", "y_m", "z_m", "rx_rad", "ry_rad", "rz_rad")},
    }
    low, high = (_number(disparity) for disparity in cameras.disparities)
    parser["meta"] = {
        "scene": cameras.scene,
        "category": cameras.category,
        "date": "",
        "version": cameras.version,
        "authors": "",
        "contact": "",
        "cycles_seed": "0",
        "disp_min": low,
        "disp_max": high,
        "frustum_disp_min": low,
        "frustum_disp_max": high,
        "depth_map_scale": "1.0",
    }
    text = StringIO()
    parser.write(text)
    return text.getvalue()


def _number(value: float) -> str:
    return repr(float(value))
