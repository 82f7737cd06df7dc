"""Presets: microlens arrays on the market, and jobs to begin with, by name."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

LENS_ARRAYS: Mapping[str, Mapping[str, Any]] = MappingProxyType(
    {
        # Fresnel Technologies, item 630, as Athineos et al. 2006 describe it in sections 3.2 and 4.1.
        "fresnel-technologies-630": {
            "lattice": "square",
            "pitch_mm": 1.0,
            "focal_length_mm": 3.3,
            "index": 1.49,
            "substrate_mm": 3.3,
        },
    }
)
"""The fields of `rig.lens_array` of each array, by the name of the array."""

_PAPER_DISPLAY = {"gap_real_mm": 4.8, "gap_virtual_mm": 3.3, "viewing_distance_mm": 1000.0}
_ARRAY = "fresnel-technologies-630"


@dataclass(frozen=True)
class Preset:
    """A job to begin with."""

    title: str
    description: str
    """A sentence that says what the job gives."""
    job: Mapping[str, Any]
    """The job file."""


PRESETS: Mapping[str, Preset] = MappingProxyType(
    {
        # Section 4.1: 100 x 100 lenses printed at 600 dpi in a window of 2400 x 2400 px.
        "paper-still": Preset(
            "Paper, still",
            "The still of the paper: 100 x 100 lenses, printed at 600 dpi in a window of 2400 x 2400 px.",
            {
                "scene": "fish",
                "title": "Athineos 2006, still",
                "rig": {
                    "lens_array": {"preset": _ARRAY, "count": [100, 100], "offset_mm": 40.0},
                    "device": {"dpi": 600, "window_px": [2400, 2400]},
                },
                "display": _PAPER_DISPLAY,
            },
        ),
        # Section 4.2: 90 x 90 lenses of 8 x 8 px, where the fish turns by 8 degrees a frame.
        "paper-iv": Preset(
            "Paper, video",
            "The integral video of the paper: 45 frames of 90 x 90 lenses and 8 x 8 views.",
            {
                "scene": "fish",
                "title": "Athineos 2006, integral video",
                "frames": "1-45",
                "rig": {
                    "lens_array": {"preset": _ARRAY, "count": [90, 90], "offset_mm": 40.0},
                    "px_per_lens": 8,
                },
                "display": _PAPER_DISPLAY,
            },
        ),
        "print-600": Preset(
            "Print at 600 dpi",
            "A page of A4 for a printer of 600 dpi, to be put under the array, with a calibration sheet.",
            {
                "scene": "fish",
                "title": "Print at 600 dpi",
                "rig": {
                    "lens_array": {"preset": _ARRAY, "count": [90, 90], "offset_mm": 40.0},
                    "device": {"dpi": 600},
                },
                "outputs": [{"kind": "print", "page": "a4"}, {"kind": "calibration_sheet"}, {"kind": "centre"}],
            },
        ),
        "panel-203": Preset(
            "Panel at 203 dpi",
            "A panel of 203 dpi, with the array amid the depths, so that the whole scene is sharp from 1 m.",
            {
                "scene": "fish",
                "title": "Panel at 203 dpi",
                "rig": {
                    "lens_array": {"preset": _ARRAY, "count": [90, 90], "offset_mm": 25.0},
                    "device": {"dpi": 203},
                },
                "outputs": [{"kind": "sheets", "of": "device"}, {"kind": "views"}],
            },
        ),
        "looking-glass": Preset(
            "Looking Glass quilt",
            "A quilt of 8 x 6 tiles of 420 x 560 px for a Looking Glass Portrait, from 16 views across.",
            {
                "scene": "fish",
                "title": "Quilt",
                "rig": {
                    "lens_array": {"preset": _ARRAY, "count": [140, 105], "offset_mm": 25.0},
                    "px_per_lens": 16,
                },
                "outputs": [{"kind": "quilt", "count": 48, "columns": 8, "aspect": 0.75, "scale": 4.0}],
            },
        ),
        # The light fields of the benchmark have 9 x 9 views of 512 x 512 px (Honauer et al., ACCV 2016).
        "hci": Preset(
            "HCI data set",
            "A light field as in the HCI benchmark: 9 x 9 views of 512 x 512 px, with the disparity of every pixel.",
            {
                "scene": "fish",
                "title": "Light field 9 x 9",
                "rig": {
                    "lens_array": {
                        "count": [512, 512], "pitch_mm": 0.2, "focal_length_mm": 1.32, "offset_mm": 25.0,
                    },
                    "px_per_lens": 9,
                },
                "capture": {"depth": True},
                "outputs": [{"kind": "hci", "views": [9, 9], "disparity": "truth"}],
            },
        ),
    }
)  # fmt: skip
"""The presets by name."""

JOBS: Mapping[str, Mapping[str, Any]] = MappingProxyType({name: preset.job for name, preset in PRESETS.items()})
"""The job of each preset, by name."""
