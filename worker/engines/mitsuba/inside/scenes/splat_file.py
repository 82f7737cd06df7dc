"""Read Gaussian splats from a .ply file in the layout of 3D Gaussian Splatting, within limits.

The layout is that of Kerbl et al., "3D Gaussian Splatting for Real-Time Radiance Field Rendering" (2023): one element
`vertex` of little-endian numbers, with x, y, z, f_dc_0..2, f_rest_*, opacity, scale_0..2 and rot_0..3. An opacity is
stored before the sigmoid, a scale as its natural logarithm, a rotation as a quaternion with w first.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import SceneError

MAX_SPLATS = 2_000_000
"""The greatest number of splats in a file."""
MAX_HEADER_BYTES = 16_384
MAX_PROPERTIES = 100
MAX_COORDINATE = 1e6
"""The greatest absolute coordinate of a centre, in units of the scene."""
MAX_LOG_SCALE = 14.0
"""The greatest logarithm of a scale; exp(14) is 1.2e6 units."""
MAX_SH = 1e4
"""The greatest absolute coefficient of a colour."""
THINNEST = 1e-3
"""The smallest axis of a splat against its greatest; a thinner splat is thickened, because rays are float32."""

_TYPES = {
    "char": "i1",
    "int8": "i1",
    "uchar": "u1",
    "uint8": "u1",
    "short": "<i2",
    "int16": "<i2",
    "ushort": "<u2",
    "uint16": "<u2",
    "int": "<i4",
    "int32": "<i4",
    "uint": "<u4",
    "uint32": "<u4",
    "float": "<f4",
    "float32": "<f4",
    "double": "<f8",
    "float64": "<f8",
}
_NEEDED = ("x", "y", "z", *(f"f_dc_{i}" for i in range(3)), "opacity", *(f"scale_{i}" for i in range(3)))
_ROTATION = tuple(f"rot_{i}" for i in range(4))
_SPZ_MAGIC = (b"\x1f\x8b", b"NGSP")
_DEGREES = {0: 0, 9: 1, 24: 2, 45: 3}
"""The degree of the spherical harmonics by the number of f_rest_*."""


@dataclass(frozen=True)
class Splats:
    """Gaussian splats, every array float32 with a row per splat."""

    centers: NDArray[np.float32]
    """The centres, (splat, 3), in units of the scene."""
    sigmas: NDArray[np.float32]
    """The standard deviations along the own axes, (splat, 3), in units of the scene."""
    quaternions: NDArray[np.float32]
    """The unit quaternions from the own axes to the scene, (splat, 4), x, y, z, w: the order of Mitsuba."""
    opacities: NDArray[np.float32]
    """The greatest opacities, (splat,), from 0 to 1."""
    harmonics: NDArray[np.float32]
    """The coefficients of the colours, (splat, function, 3), with (degree + 1)^2 functions."""
    thickened: int = 0
    """The number of splats of the file that were thinner than `THINNEST`."""

    def __len__(self) -> int:
        return len(self.centers)

    @property
    def degree(self) -> int:
        """The degree of the spherical harmonics, 0 to 3."""
        return math.isqrt(self.harmonics.shape[1]) - 1


@dataclass(frozen=True)
class _Header:
    count: int
    record: np.dtype[np.void]
    body: int


def is_splats(path: Path) -> bool:
    """Return whether a file is Gaussian splats by its header: a .ply whose vertices have `f_dc_0`, or an .spz."""
    if path.suffix.lower() == ".spz":
        return True
    if path.suffix.lower() != ".ply":
        return False
    head = _head(path)
    return head.startswith(b"ply") and re.search(rb"property\s+\w+\s+f_dc_0\s", head) is not None


def read_splats(path: Path) -> Splats:
    """Read Gaussian splats, all numbers checked.

    Raises
    ------
    SceneError
        If the file is no .ply of the layout, exceeds a limit, or holds a value that no splat has. The error names the
        file, the property and the first splat that is wrong.
    """
    if path.suffix.lower() == ".spz" or _head(path)[:4].startswith(_SPZ_MAGIC):
        raise _fault(path, "splats as .ply", "an .spz file; convert it to .ply with the tool that wrote it")
    header = _read_header(path)
    size = path.stat().st_size
    needed = header.body + header.count * header.record.itemsize
    if size < needed:
        raise _fault(path, f"{needed} bytes for {header.count} splats", f"{size} bytes")
    with path.open("rb") as file:
        file.seek(header.body)
        body = file.read(header.count * header.record.itemsize)
    return _splats(path, np.frombuffer(body, header.record, count=header.count))


def _splats(path: Path, rows: NDArray[np.void]) -> Splats:
    centers = _columns(path, rows, ("x", "y", "z"), MAX_COORDINATE)
    log_scales = _columns(path, rows, [f"scale_{i}" for i in range(3)], MAX_LOG_SCALE, smallest=-1e4)
    rotations = _columns(path, rows, _ROTATION, 1e6)
    logits = _columns(path, rows, ("opacity",), 1e6)[:, 0]
    names = rows.dtype.names or ()
    rest = len([name for name in names if name.startswith("f_rest_")])
    colour_names = [f"f_dc_{i}" for i in range(3)] + [f"f_rest_{i}" for i in range(rest)]
    colours = _columns(path, rows, colour_names, MAX_SH)
    lengths = np.linalg.norm(rotations.astype(np.float64), axis=1)
    _refuse(path, lengths < 1e-6, f"{_ROTATION[0]}..3 that is a quaternion with a length", rotations)
    w_first = (rotations / lengths[:, None]).astype(np.float32)
    sigmas = np.exp(log_scales)
    least = np.maximum(THINNEST * sigmas.max(axis=1, keepdims=True), 1e-9)
    return Splats(
        centers=centers,
        sigmas=np.maximum(sigmas, least),
        quaternions=np.ascontiguousarray(w_first[:, [1, 2, 3, 0]]),
        opacities=(1.0 / (1.0 + np.exp(-np.clip(logits, -80, 80)))).astype(np.float32),
        harmonics=_harmonics(colours),
        thickened=int((sigmas < least).any(axis=1).sum()),
    )


def _harmonics(colours: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return (splat, function, 3) from columns of f_dc and f_rest; f_rest has all functions of red, then of green."""
    rest = colours[:, 3:].reshape(len(colours), 3, -1).transpose(0, 2, 1)
    return np.ascontiguousarray(np.concatenate([colours[:, None, :3], rest], axis=1))


def _columns(
    path: Path,
    rows: NDArray[np.void],
    names: tuple[str, ...] | list[str],
    largest: float,
    smallest: float | None = None,
) -> NDArray[np.float32]:
    """Return properties as float32 (splat, property); every value is finite and between `smallest` and `largest`."""
    lowest = -largest if smallest is None else smallest
    columns = np.empty((len(rows), len(names)), np.float32)
    for index, name in enumerate(names):
        values = rows[name]
        wrong = ~((values >= lowest) & (values <= largest))
        _refuse(path, wrong, f"{name} from {lowest:g} to {largest:g}", values)
        columns[:, index] = values
    return columns


def _refuse(path: Path, wrong: NDArray[np.bool_], expected: str, values: NDArray[np.generic]) -> None:
    if wrong.any():
        index = int(np.argmax(wrong))
        raise _fault(path, expected, f"{values[index].tolist()!r} in splat {index} ({int(wrong.sum())} in all)")


def _head(path: Path) -> bytes:
    try:
        with path.open("rb") as file:
            return file.read(MAX_HEADER_BYTES)
    except OSError as error:
        raise SceneError(f"{path.name}: expected a file that can be read: {error.strerror}") from error


def _read_header(path: Path) -> _Header:
    head = _head(path)
    end = re.search(rb"^end_header\r?\n", head, re.MULTILINE)
    if not head.startswith((b"ply\n", b"ply\r\n")) or end is None:
        raise _fault(path, f"a .ply header of at most {MAX_HEADER_BYTES} bytes", "none")
    words = [line.split() for line in head[: end.start()].decode("ascii", "replace").splitlines()[1:]]
    lines = [line for line in words if line and line[0] not in ("comment", "obj_info")]
    if ["format", "binary_little_endian", "1.0"] not in lines:
        raise _fault(path, "format binary_little_endian 1.0", " ".join(lines[0][1:3] if lines else ["none"]))
    elements = [index for index, line in enumerate(lines) if line[0] == "element"]
    if not elements or lines[elements[0]][1:2] != ["vertex"]:
        got = " ".join(lines[elements[0]][1:2]) if elements else "none"
        raise _fault(path, "the element vertex first, not a compressed layout", f"element {got!r}")
    stop = elements[1] if len(elements) > 1 else len(lines)
    return _Header(_count(path, lines[elements[0]]), _record(path, lines[elements[0] + 1 : stop]), end.end())


def _count(path: Path, line: list[str]) -> int:
    text = line[2] if len(line) == 3 else ""
    if not re.fullmatch(r"[0-9]{1,12}", text) or not 1 <= int(text) <= MAX_SPLATS:
        raise _fault(path, f"1 to {MAX_SPLATS} splats", text[:40] or "none")
    return int(text)


def _record(path: Path, lines: list[list[str]]) -> np.dtype[np.void]:
    if len(lines) > MAX_PROPERTIES:
        raise _fault(path, f"at most {MAX_PROPERTIES} properties", str(len(lines)))
    fields: dict[str, str] = {}
    for line in lines:
        if len(line) != 3 or line[0] != "property" or line[1] not in _TYPES or line[2] in fields:
            raise _fault(path, "properties of one number, each once", repr(" ".join(line)[:80]))
        fields[line[2]] = _TYPES[line[1]]
    missing = [name for name in (*_NEEDED, *_ROTATION) if name not in fields]
    if missing:
        raise _fault(path, "the properties of 3D Gaussian Splatting", f"no {', '.join(missing)}")
    rest = [name for name in fields if name.startswith("f_rest_")]
    if len(rest) not in _DEGREES or any(f"f_rest_{index}" not in fields for index in range(len(rest))):
        raise _fault(path, "0, 9, 24 or 45 properties f_rest_0 .. (degree 0 to 3)", str(len(rest)))
    return np.dtype(list(fields.items()))


def _fault(path: Path, expected: str, got: str) -> SceneError:
    return SceneError(f"{path.name}: expected {expected}, got {got}")
