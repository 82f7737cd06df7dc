"""Decode one picture in a process of its own: the program that runs inside the sandbox.

Run as a file of its own (`python -I decoder.py PICTURE PAGE ROWS COLS [CHANNEL...]`, in the only folder that can be
written), so that nothing but NumPy and OpenImageIO must be readable inside. PICTURE is one of `NAMES`, and PAGE the
place of the picture in the file. `PIXELS` then holds the numbers of these channels, or of red, green and blue, rows
from the top, and the last line of output is their type: `uint8`, `uint16`, `half`, `float`. A picture that cannot be
decoded gives the exit code 3 and the reason as the last line.

Whoever starts it believes nothing but the number of bytes that the header of the picture allows.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from typing import Any

REFUSED = 3
"""The exit code for a picture that cannot be decoded."""
PIXELS = "pixels.raw"
"""The name of the file with the decoded numbers."""
TYPES = {"uint8": "uint8", "uint16": "uint16", "half": "half", "float": "float", "double": "float"}
"""The types of numbers that are written, by those of the file."""

NAMES = {
    "PNG": "picture.png",
    "TIFF": "picture.tif",
    "EXR": "picture.exr",
    "JPEG": "picture.jpg",
    "PFM": "picture.pfm",
    "PNM": "picture.pnm",
}
"""The name of the picture by its format: OpenImageIO chooses the reader by the suffix."""

WHITE_IS_ZERO = 0
"""The photometric interpretation of a TIFF in which 0 is white (TIFF 6.0, tag 262)."""

_BAND_BYTES = 16_000_000
_COLOURS = (("r", "g", "b"), ("red", "green", "blue"))
"""The names of channels, in any case."""
_GREYS = ("Y", "I", "L", "grey", "gray", "luminance")


class Refused(Exception):
    """The picture cannot be decoded."""


def places(names: list[str], alpha: int) -> list[int]:
    """Return the indices of red, green and blue among the channels; grey is all three.

    Parameters
    ----------
    names
        The names of the channels.
    alpha
        The index of alpha; negative without alpha.
    """
    layers = _layers(names)
    if "" in layers or len(layers) == 1:
        return layers.get("") or next(iter(layers.values()))
    if layers:
        raise Refused(f"expected red, green and blue of one layer, got those of the layers {tuple(layers)[:8]}")
    if {"RY", "BY"} & set(names):
        raise Refused(f"expected red, green and blue, got luminance with chroma, channels {tuple(names[:8])}")
    if len(names) == 1 or (len(names) == 2 and alpha == 1):
        return [0, 0, 0]
    for grey in _GREYS:
        if grey in names:
            return [names.index(grey)] * 3
    raise Refused(f"expected red, green and blue, or grey, got channels {tuple(names[:8])}")


def _layers(names: list[str]) -> dict[str, list[int]]:
    """Return the indices of red, green and blue of every layer that has all three, by its name, which may be empty."""
    found: dict[str, dict[str, int]] = {}
    for place, name in enumerate(names):
        layer, _, channel = name.rpartition(".")
        found.setdefault(layer, {}).setdefault(channel.lower(), place)
    layers: dict[str, list[int]] = {}
    for layer, channels in found.items():
        for wanted in _COLOURS:
            if layer not in layers and all(name in channels for name in wanted):
                layers[layer] = [channels[name] for name in wanted]
    return layers


def named_places(names: list[str], channels: list[str]) -> list[int]:
    """Return the indices of channels of these names."""
    if not set(channels) <= set(names):
        raise Refused(f"expected channels {tuple(channels)}, got {tuple(names[:8])}")
    return [names.index(channel) for channel in channels]


def decode(name: str, page: int, rows: int, cols: int, channels: list[str]) -> str:
    """Write the numbers of a page of a picture in the working directory to `PIXELS` and return their type."""
    import OpenImageIO

    # No other reader is tried than the one for the suffix.
    OpenImageIO.attribute("try_all_readers", 0)
    OpenImageIO.attribute("threads", 1)
    OpenImageIO.attribute("exr_threads", -1)
    ask = OpenImageIO.ImageSpec()
    ask.attribute("oiio:UnassociatedAlpha", 1)  # else colours come multiplied by alpha
    picture = OpenImageIO.ImageInput.open(name, ask)
    if picture is None:
        raise Refused(_words(OpenImageIO.geterror()))
    if page and not picture.seek_subimage(page, 0):
        raise Refused(_words(picture.geterror()))
    spec = picture.spec()
    if (spec.height, spec.width, spec.depth) != (rows, cols, 1):
        raise Refused(f"expected {rows} x {cols} x 1 px, got {spec.height} x {spec.width} x {spec.depth} px")
    numbers = str(spec.format)
    if numbers not in TYPES:
        raise Refused(f"expected 8 or 16 bits, or floating numbers, got {numbers}")
    if numbers == "double" and spec.tile_height:
        # OpenImageIO 3.2 returns other numbers than those of the file.
        raise Refused("expected numbers of 16 or 32 bits in tiles, got 64; convert them to 32 bits")
    names = list(spec.channelnames)
    wanted = named_places(names, channels) if channels else places(names, spec.alpha_channel)
    is_negative = _is_negative(spec, numbers)
    with open(PIXELS, "xb") as file:
        for band in _bands(picture, max(wanted) + 1, TYPES[numbers]):
            chosen = band[..., wanted]
            file.write((~chosen if is_negative else chosen).tobytes())
    return TYPES[numbers]


def _is_negative(spec: Any, numbers: str) -> bool:
    """Return whether the codes of a TIFF are still to be inverted, as 0 is white: OpenImageIO inverts 8 bits alone."""
    if spec.getattribute("tiff:PhotometricInterpretation") != WHITE_IS_ZERO or numbers == "uint8":
        return False
    if numbers != "uint16":
        raise Refused("expected 0 to be black in floating numbers, got a TIFF in which it is white (WhiteIsZero)")
    return True


def _bands(picture: Any, channels: int, numbers: str) -> Iterator[Any]:
    """Yield bands of rows of an open picture, `(rows, cols, channel)`."""
    spec = picture.spec()
    x, y, rows, cols, high = spec.x, spec.y, spec.height, spec.width, spec.tile_height or 1
    step = max(1, _BAND_BYTES // (cols * channels * 4) // high) * high
    for start in range(0, rows, step):
        stop = min(rows, start + step)
        if spec.tile_height:
            band = picture.read_tiles(x, x + cols, y + start, y + stop, 0, 1, 0, channels, numbers)
        else:
            band = picture.read_scanlines(y + start, y + stop, 0, 0, channels, numbers)
        # Some readers return the rows that they have, and report the missing rows only as an error.
        trouble = picture.geterror()
        if band is None or trouble:
            raise Refused(_words(trouble))
        yield band.reshape(stop - start, cols, channels)


def _words(trouble: str) -> str:
    return " ".join(trouble.split()) or "cannot be read"


def main(words: list[str]) -> int:
    """Decode the picture that the command line names; return the exit code."""
    name, page, rows, cols, *channels = words
    try:
        said, code = decode(name, int(page), int(rows), int(cols), channels), 0
    except Refused as error:
        said, code = str(error), REFUSED
    except MemoryError:
        said, code = (
            "expected a picture that is decoded within the memory for its size, got one that needs more",
            REFUSED,
        )
    sys.stdout.write(f"{said}\n")
    return code


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
