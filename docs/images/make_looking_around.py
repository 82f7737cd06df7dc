"""Draw looking-around.webp, the README's picture: an eye moves before an integral image of 240 x 240 lenses.

Run it as `python docs/images/make_looking_around.py`. It renders the integral image into out/looking-around first, if
it is not there, which takes some minutes.
On the left is what the eye sees through the lenses, on the right the integral image itself with a part enlarged.
"""

from __future__ import annotations

import math
import subprocess
import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from lippmann import Eye, IntegralImage
from worker.images.colour import srgb_codes

OUT = Path("out/looking-around")
RIG = {"count": "[240,240]", "pitch_mm": "0.375", "focal_length_mm": "1.5", "offset_mm": "20"}
PX_PER_LENS = 16
PICTURE = Path(__file__).with_name("looking-around.webp")
MAX_BYTES = 2_000_000

SIDE_PX, GAP_PX = 432, 8
FRAMES, FRAME_MS = 40, 70
REACH_MM, DISTANCE_MM = (64.0, 22.0), 900.0
"""How far the eye moves to the sides and up and down, and its distance from the display."""
PART_PX, PART_SIDE_PX = 5 * PX_PER_LENS, 200
"""The sides of the enlarged part: of the integral image, and in the picture."""
PART_AT = (1520, 1760)
"""The row and column of the first pixel of the part."""


def main() -> None:
    """Write the animation."""
    master = OUT / "orthoscopic" / "0001.exr"
    if not master.is_file():
        values = [f"rig.lens_array.{name}={value}" for name, value in RIG.items()]
        options = [part for value in (*values, f"rig.px_per_lens={PX_PER_LENS}") for part in ("--set", value)]
        command = [sys.executable, "-m", "lippmann.cli.main", "capture", "fish", *options, "--out", str(OUT)]
        subprocess.run(command, check=True)
    image = IntegralImage.open(master)
    beside = sheet_picture(image.pixels)
    frames = [Image.new("RGB", (2 * SIDE_PX + GAP_PX, SIDE_PX), "white") for _ in range(FRAMES)]
    for number, frame in enumerate(frames):
        turn = 2 * math.pi * number / FRAMES
        eye = Eye(REACH_MM[0] * math.sin(turn), REACH_MM[1] * math.cos(turn), DISTANCE_MM)
        frame.paste(picture_of(image.observe(eye, size_px=SIDE_PX, rays=16)), (0, 0))
        frame.paste(beside, (SIDE_PX + GAP_PX, 0))
    frames[0].save(PICTURE, save_all=True, append_images=frames[1:], duration=FRAME_MS, loop=0, quality=72, method=6)
    size = PICTURE.stat().st_size
    if size >= MAX_BYTES:
        sys.exit(f"expected less than {MAX_BYTES} bytes, got {size}")


def sheet_picture(pixels: NDArray[np.floating]) -> Image.Image:
    """Return the integral image as a small square with an enlarged part in its corner."""
    whole = picture_of(pixels)
    small = whole.resize((SIDE_PX, SIDE_PX), Image.Resampling.BOX)
    row, col = PART_AT
    part = whole.crop((col, row, col + PART_PX, row + PART_PX))
    framed = Image.new("RGB", (PART_SIDE_PX + 4, PART_SIDE_PX + 4), "white")
    framed.paste(part.resize((PART_SIDE_PX, PART_SIDE_PX), Image.Resampling.NEAREST), (2, 2))
    small.paste(framed, (SIDE_PX - framed.width, SIDE_PX - framed.height))
    return small


def picture_of(light: NDArray[np.floating]) -> Image.Image:
    """Return linear light, `(row, col, channel)`, as a picture of sRGB codes."""
    return Image.fromarray(srgb_codes(np.asarray(light, dtype=np.float32)[..., :3]))


if __name__ == "__main__":
    main()
