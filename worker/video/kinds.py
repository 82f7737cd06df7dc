"""The codecs, and their settings for FFmpeg, in one table.

| codec | for | encoder | pixels |
|---|---|---|---|
| `h264` | people: plays everywhere | x264, `fast` | BT.709 in video range, 4:2:0 or 4:4:4 |
| `h265` | players at home, coding studies | x265, `medium` | the same |
| `av1` | people: the smallest files | SVT-AV1, preset 8 | the same in 4:2:0, 8 or 10 bits |
| `vp9` | people: browsers without the others | libvpx, `good`, speed 4 | the same as `h264` |
| `ffv1` | work: nothing is lost | FFmpeg's own, version 3 | red, green and blue of 8, 10 or 16 bits, with CRCs |

The encoder's own constant rate factor (`crf`) sets the quality. Instead, the *quantizer* may be constant (`qp`), as
coding studies need it, the same for every type of picture: 0 to 51 for x264 and x265, 1 to 63 for SVT-AV1, 0 to 63 for
libvpx.

The same frames give the same bytes: no dates, no random numbers, and a fixed number of threads, which x264's bits
depend on. Not so by x265: of small pictures its bits differ from run to run (measured at 64 and 128 px).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from lippmann.errors import OutputError
from lippmann.job.outputs.codecs import CHOICES, Bits, Chroma, Codec, Container

THREADS = 2
"""The number of threads of every encoder."""

Settings = Mapping[str, str]


@dataclass(frozen=True)
class Kind:
    """A codec in a container with its settings, as `kind` returns it."""

    encoder: str
    """The encoder by FFmpeg's name."""
    container: Container
    pixel_format: str
    """The pixel format by FFmpeg's name."""
    bits: Bits
    """The bits of a code: frames are uint8 for 8 bits, uint16 for more."""
    settings: Settings
    """The settings of the encoder."""

    @property
    def is_rgb(self) -> bool:
        """True if red, green and blue are kept without a matrix."""
        return not self.pixel_format.startswith("yuv")

    @property
    def needs_even_sides(self) -> bool:
        """True if two pixels in each direction share one colour: 4:2:0."""
        return self.pixel_format.startswith("yuv420")

    @property
    def least_side_px(self) -> int:
        """The shortest side of a picture that the encoder takes, px."""
        return LEAST_SIDE_PX.get(self.encoder, 1)

    @property
    def muxer(self) -> str:
        """The name of the container in FFmpeg."""
        return "matroska" if self.container == "mkv" else self.container

    @property
    def muxer_settings(self) -> Settings:
        """The settings of the container; an MP4 has its index at the beginning, so it plays while it downloads."""
        return {"fflags": "+bitexact"} | ({"movflags": "+faststart"} if self.container == "mp4" else {})


@dataclass(frozen=True)
class _Encoder:
    name: str
    settings: Settings
    at_qp: Callable[[str], Settings] | None
    """Returns the settings for a constant quantizer, which replace settings of the same names."""


LEAST_SIDE_PX = {"libx265": 16, "libsvtav1": 4}
"""Encoders that refuse smaller pictures, by FFmpeg's name; a test holds the numbers against the encoders."""

_X264 = "mbtree=0"
"""x264's macroblock tree reads what it has not written when the picture is small (the bits differ from run to run,
measured at 64 x 64 px), so it is off."""
_X265 = f"pools={THREADS}:frame-threads=1:no-cutree=1:log-level=error"
"""Its tree writes beside its memory when a side is below 64 px, and the process ends (4.2, measured)."""
_SAME_FOR_ALL = "ipratio=1:pbratio=1"
"""x264 and x265 otherwise quantize key pictures finer, and pictures between others coarser."""

_ENCODERS: Mapping[Codec, _Encoder] = {
    "h264": _Encoder(
        "libx264",
        {"preset": "fast", "x264-params": _X264, "threads": str(THREADS)},
        lambda qp: {"qp": qp, "x264-params": f"{_X264}:{_SAME_FOR_ALL}"},
    ),
    "h265": _Encoder(
        "libx265",
        {"preset": "medium", "x265-params": _X265},
        lambda qp: {"x265-params": f"{_X265}:{_SAME_FOR_ALL}:qp={qp}"},
    ),
    "av1": _Encoder(
        "libsvtav1",
        {"preset": "8", "svtav1-params": f"lp={THREADS}"},
        lambda qp: {"qp": qp, "svtav1-params": f"lp={THREADS}:aq-mode=0:use-fixed-qindex-offsets=1"},
    ),
    "vp9": _Encoder(
        "libvpx-vp9",
        {"deadline": "good", "cpu-used": "4", "b": "0", "row-mt": "1", "threads": str(THREADS)},
        lambda qp: {"crf": qp, "qmin": qp, "qmax": qp},
    ),
    "ffv1": _Encoder(
        "ffv1",
        {"level": "3", "g": "1", "slices": "4", "slicecrc": "1", "threads": str(THREADS)},
        None,
    ),
}

_PIXEL_FORMATS: Mapping[tuple[Chroma | None, Bits], str] = {
    ("4:2:0", 8): "yuv420p",
    ("4:2:0", 10): "yuv420p10le",
    ("4:4:4", 8): "yuv444p",
    (None, 8): "bgr0",
    (None, 10): "gbrp10le",
    (None, 16): "gbrp16le",
}


def kind(
    codec: Codec,
    *,
    container: Container | None = None,
    crf: int | None = None,
    qp: int | None = None,
    chroma: Chroma | None = None,
    bits: Bits = 8,
    intra: bool = False,
) -> Kind:
    """Return a codec in a container, set; arguments that are not given have the defaults of `CHOICES`.

    Parameters
    ----------
    codec
        One of `CHOICES`.
    container
        One of the codec's.
    crf, qp
        One of them: the constant rate factor, or a quantizer that holds still; see the module.
    chroma
        The chroma subsampling; None if red, green and blue are kept.
    bits
        The bits of a code.
    intra
        Whether every frame stands alone.

    Raises
    ------
    OutputError
        If the codec cannot do it.

    Examples
    --------
    >>> kind("av1", container="webm", bits=10).pixel_format
    'yuv420p10le'
    """
    choices, encoder = CHOICES[codec], _ENCODERS[codec]
    chroma = chroma or (choices.chroma[0] if choices.chroma else None)
    container = container or choices.containers[0]
    possible = (container in choices.containers, bits in choices.bits, chroma is None or chroma in choices.chroma)
    if not all(possible):
        raise OutputError(f"expected of {codec} one of {choices}, got {container}, {bits} bits, chroma {chroma}")
    if qp is not None and (crf is not None or encoder.at_qp is None):
        raise OutputError(f"expected of {codec} {'either a qp or a crf' if encoder.at_qp else 'no qp'}, got qp {qp}")
    rate = crf if crf is not None else choices.crf
    rated: Settings = {} if rate is None else {"crf": str(rate)}
    if qp is not None and encoder.at_qp is not None:
        # SVT-AV1 takes 0 as the default.
        if not (codec == "av1") <= qp <= choices.worst_crf:
            raise OutputError(f"expected of {codec} a qp from {int(codec == 'av1')} to {choices.worst_crf}, got {qp}")
        rated = encoder.at_qp(str(qp))
    return Kind(
        encoder=encoder.name,
        container=container,
        pixel_format=_PIXEL_FORMATS[chroma, bits],
        bits=bits,
        settings={**encoder.settings, **rated, **({"g": "1"} if intra else {}), "flags": "+bitexact"},
    )


H264, FFV1 = kind("h264"), kind("ffv1")
"""H.264 for people, and FFV1 without loss."""
