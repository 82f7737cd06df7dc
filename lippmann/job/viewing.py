"""Terms and defaults for viewing a display: eyes, gaps, stereo pairs and resampling filters."""

from __future__ import annotations

from typing import Literal

Stereo = Literal["side_by_side", "cross_eyed", "anaglyph"]
"""`side_by_side`: the left eye's picture at the left; `cross_eyed`: at the right; `anaglyph`: for red-cyan glasses."""

EyePath = Literal["horizontal", "vertical", "circle", "toward", "still"]
"""`horizontal`: to the right, to the left and back; `vertical`: up, down and back; `circle`: from the right upward and
round; `toward`: nearer and back; `still`: nowhere."""

GapUse = Literal["real", "virtual", "collimated"]
"""The gap for what is shown before the display, for what is shown behind it, and for parallel light: a focal length."""

Bare = Literal["clear", "black"]
"""What is there where no lens is: nothing, so that light goes straight, or something opaque."""

Surround = Literal["black", "white"]
"""What lies round the pixels: a dark frame, or the paper that they are printed on."""

EYES_APART_MM = 63.0
"""People's mean (N. A. Dodgson, *Variation and extrema of human interpupillary distance*, Proc. SPIE 5291, 2004)."""

PUPIL_MM = 4.0
"""Of an eye in a lit room."""

REACH_MM = 30.0
"""Of an eye that moves to the side: inside the viewing zone of every lens of the paper's array from 500 mm."""

RAYS, MOVING_RAYS = 64, 16
"""Through the pupil for every pixel, of a still picture and of a clip: docs/observer.md says what more would change."""

SIZE_PX = 720
"""Longer side of a picture."""

MAX_SIZE_PX = 8192
"""Of a side of a picture."""

MAX_RAYS = 16_384
"""Of a pixel: far beyond what codes can tell apart."""


Filter = Literal["box", "triangle", "mitchell", "lanczos3"]
"""`box` keeps the borders of pixels when enlarging; `triangle` is linear; `lanczos3` is sharp and rings a little."""
