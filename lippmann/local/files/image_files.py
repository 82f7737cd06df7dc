"""Write integral images and pictures: EXR with the lenses in its header, PNG and TIFF as sRGB codes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import BadInput, LayoutError
from lippmann.job.optics.rig import Rig
from lippmann.lightfield.image import IntegralImage
from lippmann.plan import artifact_names as names
from lippmann.plan.sampling import display_size, frame_size
from worker.images.colour import srgb_codes
from worker.images.resize import resize
from worker.images.write import encoded_png, write_code_rows, write_exr

Light = NDArray[np.floating[Any]]

CODE_SUFFIXES = (".png", ".tif", ".tiff")


def save_picture(picture: Light, path: str | Path, *, scale: int = 1, bits: int = 8) -> None:
    """Save a picture of linear light as sRGB codes; the file appears when it is whole.

    Parameters
    ----------
    picture
        `(row, col, channel)` or `(row, col)`, floating, linear light; one channel is grey.
    path
        A PNG or TIFF.
    scale
        How many times a pixel is repeated each way.
    bits
        The bits a channel: 8 or 16.

    Raises
    ------
    BadInput
        If it is another kind of file.
    LayoutError
        If the picture does not have one or three channels.
    OutputError, DiskFull, DiskUnavailable
        If the file cannot be written.
    """
    file, light = Path(path), three_channels(picture)
    if file.suffix.lower() not in CODE_SUFFIXES:
        raise BadInput(f"expected a PNG or a TIFF to write, got {file}")
    enlarged = light.repeat(scale, axis=0).repeat(scale, axis=1)
    beside = _beside(file)
    write_code_rows(beside, (srgb_codes(enlarged, bits=bits),), size=enlarged.shape[:2], bits=bits)
    beside.replace(file)


def save_image(image: IntegralImage, path: Path, *, rig: Rig | None, bits: int) -> None:
    """Save an integral image; see `lippmann.IntegralImage.save`.

    Parameters
    ----------
    image
        The image.
    path
        An EXR, PNG or TIFF.
    rig
        The rig that captured the image, if it is known.
    bits
        The bits a channel of a PNG or TIFF.
    """
    if path.suffix.lower() != ".exr":
        if path.suffix.lower() not in CODE_SUFFIXES:
            raise BadInput(f"expected an EXR, a PNG or a TIFF to write, got {path}")
        save_picture(image.pixels, path, bits=bits)
        return
    kind, beside = names.PSEUDOSCOPIC if image.pseudoscopic else names.ORTHOSCOPIC, _beside(path)
    header = {"rig": _describing_rig(image, rig).model_dump_json(), names.KIND: kind}
    write_exr(beside, three_channels(image.pixels), attributes=header)
    beside.replace(path)


def preview_png(picture: Light, *, longest_px: int) -> bytes:
    """Return a picture as the bytes of a PNG, reduced to at most so many pixels on its longer side.

    Parameters
    ----------
    picture
        `(row, col, channel)`, linear light, one or three channels.
    longest_px
        The longer side, px.
    """
    light = three_channels(picture)
    shrink = longest_px / max(light.shape[:2])
    if shrink < 1:
        rows, cols = (max(1, round(side * shrink)) for side in light.shape[:2])
        light = resize(light, rows=rows, cols=cols, filter_name="triangle")
    with encoded_png(light, bits=8) as file:
        return file.read()


def three_channels(picture: Light) -> Light:
    """Return a picture `(row, col, channel)` or `(row, col)` with three channels.

    Raises
    ------
    LayoutError
        If it does not have one or three.
    """
    shaped = picture[..., np.newaxis] if picture.ndim == 2 else picture
    if shaped.ndim != 3 or shaped.shape[2] not in (1, 3):
        raise LayoutError(f"expected a picture of one channel or of red, green and blue, got shape {picture.shape}")
    return np.broadcast_to(shaped, (*shaped.shape[:2], 3))


def _beside(file: Path) -> Path:
    return file.with_name(f".{file.stem}.part{file.suffix}")


def _describing_rig(image: IntegralImage, known: Rig | None) -> Rig:
    """Return a rig that describes the lenses of an image: the known one, or else one of direct pickup.

    A hexagonal image whose first lens row is shifted is described by a capture through an imaging lens, which turns an
    odd number of rows upside down.
    """
    layout = image.layout
    lens_array = {
        "count": (layout.lens_rows, layout.lens_cols), "lattice": layout.lattice, "pitch_mm": image.pitch_mm,
        "focal_length_mm": image.focal_length_mm,
    }  # fmt: skip
    lens = "athineos-2006" if image.inverted or layout.first_row_shifted else None
    made = {"imaging_lens": lens, "px_per_lens": layout.px_per_lens, "lens_array": lens_array}
    for rig in (known, Rig.model_validate(made)):
        if rig is not None and _describes(rig, image):
            return rig
    raise LayoutError(f"expected lenses that a rig can describe, got {layout} whose first row is shifted")


def _describes(rig: Rig, image: IntegralImage) -> bool:
    array = rig.lens_array
    same_mm = (array.pitch_mm, array.focal_length_mm) == (image.pitch_mm, image.focal_length_mm)
    same_sense = not image.pseudoscopic or image.inverted == (rig.imaging_lens is not None)
    return same_mm and same_sense and image.layout == (frame_size(rig) if image.pseudoscopic else display_size(rig))
