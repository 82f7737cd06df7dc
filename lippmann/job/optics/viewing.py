"""Terms and defaults for viewing a display: eyes, gaps, stereo pairs and resampling filters."""

from __future__ import annotations

from typing import Literal

Stereo = Literal["side_by_side", "cross_eyed", "anaglyph"]
"""The arrangement of a stereo pair. The picture of the left eye is at the left in `side_by_side` and at the right in
`cross_eyed`; `anaglyph` is for red-cyan glasses."""

EyePath = Literal["horizontal", "vertical", "circle", "toward", "still"]
"""The path of an eye that moves. `horizontal`: to the right, to the left and back. `vertical`: up, down and back.
`circle`: a circle that starts at the right and goes upward. `toward`: nearer and back. `still`: the eye does not
move."""

GapUse = Literal["real", "virtual", "collimated"]
"""The gap that a display is built with. `real` suits images in front of the display, `virtual` images behind it;
`collimated` is one focal length, for which a lens sends parallel light."""

Bare = Literal["clear", "black"]
"""The area of a display that no lens covers: clear, so that light passes straight through, or opaque."""

Surround = Literal["black", "white"]
"""The area around the pixels: a dark frame, or the white paper that they are printed on."""

EYES_APART_MM = 63.0
"""The mean interpupillary distance of adults (N. A. Dodgson, *Variation and extrema of human interpupillary distance*,
Proc. SPIE 5291, 2004)."""

PUPIL_MM = 4.0
"""The diameter of the pupil of an eye in a lit room."""

REACH_MM = 30.0
"""The reach of an eye that moves to the side; from 500 mm it stays in the viewing zone of every lens of the paper's
array."""

RAYS, MOVING_RAYS = 64, 16
"""The number of rays through the pupil for every pixel, of a still picture and of a clip. docs/observer.md describes
the effect of more rays."""

SIZE_PX = 720
"""The default length of the longer side of a picture."""

MAX_SIZE_PX = 8192
"""The greatest length of a side of a picture."""

MAX_RAYS = 16_384
"""The greatest number of rays for a pixel; more rays change no code of a picture."""


PictureFormat = Literal["png", "webp", "exr"]
"""The format of a picture: PNG and WebP have sRGB codes of 8 bits, and EXR has linear light in single precision."""

Filter = Literal["box", "triangle", "mitchell", "lanczos3"]
"""The resampling filter of an enlarged picture. `box` keeps the borders of pixels, `triangle` is linear, `lanczos3` is
sharp and rings a little."""
