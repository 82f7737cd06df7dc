"""Presets: microlens arrays on the market, and the jobs of the paper, by name."""

from __future__ import annotations

from collections.abc import Mapping
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

JOBS: Mapping[str, Mapping[str, Any]] = MappingProxyType(
    {
        # Section 4.1: 100 x 100 lenses printed at 600 dpi in a window of 2400 x 2400 px.
        "paper-still": {
            "scene": "fish",
            "title": "Athineos 2006, still",
            "rig": {
                "lens_array": {"preset": "fresnel-technologies-630", "count": [100, 100], "offset_mm": 40.0},
                "device": {"dpi": 600, "window_px": [2400, 2400]},
            },
            "display": _PAPER_DISPLAY,
        },
        # Section 4.2: 90 x 90 lenses of 8 x 8 px, where the fish turns by 8 degrees a frame.
        "paper-iv": {
            "scene": "fish",
            "title": "Athineos 2006, integral video",
            "frames": "1-45",
            "rig": {
                "lens_array": {"preset": "fresnel-technologies-630", "count": [90, 90], "offset_mm": 40.0},
                "px_per_lens": 8,
            },
            "display": _PAPER_DISPLAY,
        },
    }
)
"""The job of each preset, by name."""
