"""Pictures of other programs as linear light: read by content, bounded by their header, decoded inside the sandbox.

`worker.images.foreign.header` names the format and the size, and refuses every other format, and what is too
large. A child in the sandbox decodes the picture with the one reader for its content, and leaves raw numbers. What it
leaves is read without following links, and only as many bytes as the header allows.
"""

from __future__ import annotations

import math
import shutil
import signal
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import ArtifactBroken, LippmannError, RenderCrashed, RenderFailed, SandboxMissing, Stopped
from lippmann.job.optics.rig import MAX_FRAME_PX
from worker.images.bands.rows import bands_of_rows
from worker.images.bands.scratch import ScratchRows, scratch_rows
from worker.images.colour import srgb_codes
from worker.images.convert import MASTER
from worker.images.foreign import decoder
from worker.images.foreign.colour_space import colour_space, light_of_codes, linear_space
from worker.images.foreign.header import read_header
from worker.images.foreign.upright import upright
from worker.images.headers.picture import PictureHeader
from worker.images.read import Light
from worker.sandbox.detect import detect_once
from worker.sandbox.ending import Ending
from worker.sandbox.limits import Limits, TimeLimit, TimeLimits
from worker.sandbox.log import AttemptLog
from worker.sandbox.process import Outcome, run
from worker.sandbox.results import take_result
from worker.sandbox.sandbox import COMPLAINTS, PATH, Sandbox
from worker.settings import WorkerSettings

START_S = 60.0
"""The CPU time in which Python starts with its libraries, on a slow machine."""
BYTES_PER_S = 10_000_000
"""The slowest speed of decoding that is waited for, in bytes of decoded numbers per CPU second."""
WAIT = 8.0
"""The elapsed seconds per CPU second on a machine that does other work too."""
PROGRAM_MB = 1024
"""The address space of Python with its libraries."""

_Shape = tuple[int, int, int]
_MIB = 1 << 20
_DECODER = "decoder.py"
_DTYPES = {"uint8": np.uint8, "uint16": np.uint16, "half": np.float16, "float": np.float32}


def _never() -> bool:
    return False


def read_imported(
    path: Path,
    *,
    page: int | None = None,
    linear: bool = False,
    white_level: int | None = None,
    sandbox: Sandbox | None = None,
    at_most_px: int | None = None,
    scratch: Path | None = None,
    should_stop: Callable[[], bool] = _never,
) -> NDArray[np.float32]:
    """Return a picture of any program as linear light, `(rows, cols, 3)`.

    Whole numbers are decoded by the file's colour space; floating ones are linear light. Alpha is left out, and what it
    covers is not darkened by it. Grey becomes three equal channels. A picture whose header says that it is stored
    sideways or mirrored is turned upright.

    Parameters
    ----------
    path
        PNG, TIFF, EXR, JPEG, PFM or PNM, whatever its suffix.
    page
        The number of the page of a TIFF, from 0; None refuses a file of several pages.
    linear
        Read codes as linear light, whatever colour space the file names.
    white_level
        The number that is white, and above which everything is, as the file counts: up to 1023 in a PGM whose highest
        code is 1023. By default the highest code of the file, or 1.0 of floating numbers. Cameras with 12 bits write
        4095 into files with 16.
    sandbox
        The sandbox of the decoder; by default the best one of this machine, or only limits where no sandbox works.
    at_most_px
        The limit of rows x columns; by default that of the worker's settings.
    scratch
        A folder for the decoded numbers; by default that of the system.
    should_stop
        Is called while the picture is decoded; True ends that.

    Raises
    ------
    ArtifactMissing
        If there is no such file.
    ArtifactBroken
        If it is no such picture, is cut short, too large, has other channels than red, green and blue, or grey, has
        several pages of which none is named, or has no such white level.
    SandboxMissing
        If the sandbox does not start.
    RenderCrashed
        If the decoder was ended by a signal.
    Stopped
        If `should_stop` returned True.
    """
    header = _bounded_header(path, at_most_px, page)
    _check_white_level(path, header, white_level)
    space = linear_space(None) if linear else colour_space(header)
    light = np.empty((header.rows, header.cols, 3), dtype=np.float32)
    for start, band in _decoded(path, header, sandbox or _own_sandbox(), scratch, should_stop):
        if band.dtype.kind == "f":
            light[start : start + len(band)] = band if white_level is None else band / np.float32(white_level)
        else:
            white = 1.0 if white_level is None else white_level / header.highest_code
            light[start : start + len(band)] = light_of_codes(band, space, white=white)
    return upright(light, header.orientation)


def read_depth_numbers(path: Path, channels: Sequence[str]) -> NDArray[np.float32]:
    """Return channels of an EXR that a stranger may have made, by their names, `(rows, cols, channel)`.

    Raises
    ------
    ArtifactMissing, ArtifactBroken, SandboxMissing, RenderCrashed
        See `read_imported`; it may be as large as a frame.
    """
    return _numbers_of(path, np.float32, channels)


def read_master_light(path: Path) -> NDArray[np.float16]:
    """Return the light of a master that a stranger may have made, in half floats, `(rows, cols, 3)`.

    Raises
    ------
    ArtifactMissing, ArtifactBroken, SandboxMissing, RenderCrashed
        See `read_imported`; a master may be as large as a frame.
    """
    return _numbers_of(path, np.float16)


def picture_codes(path: Path, *, linear: bool = False) -> NDArray[np.uint8]:
    """Return the sRGB codes of a master or of a picture of any program, `(rows, cols, 3)`.

    The codes of a picture in sRGB are returned as they are stored, 16 bits rounded. Those in another colour space
    are decoded and encoded again.

    Parameters
    ----------
    path
        A master (EXR), or another picture.
    linear
        Read codes as linear light, whatever colour space the file names.

    Raises
    ------
    ArtifactMissing, ArtifactBroken, SandboxMissing, RenderCrashed
        See `read_imported`.
    """
    if path.suffix.lower() == MASTER:
        return srgb_codes(_numbers_of(path, np.float32))
    header = _bounded_header(path, None, None)
    if linear or colour_space(header).name != "sRGB":
        return srgb_codes(read_imported(path, linear=linear))
    codes = np.empty((header.rows, header.cols, 3), dtype=np.uint8)
    for start, band in _decoded(path, header, _own_sandbox()):
        codes[start : start + len(band)] = band if band.dtype == np.uint8 else np.rint(band / np.float32(257))
    return upright(codes, header.orientation)


@contextmanager
def decoded_rows(path: Path, *, is_master: bool, scratch: Path | None = None) -> Iterator[ScratchRows]:
    """Yield a picture of any program whose rows can be read in any order, as numbers of its own type.

    Parameters
    ----------
    is_master
        True for an EXR, which is read in half floats.
    scratch
        A folder for its decoded numbers, which are there twice for a moment; by default that of the system.

    Raises
    ------
    ArtifactMissing, ArtifactBroken, SandboxMissing, RenderCrashed
        See `read_imported`; it may be as large as a frame.
    DiskFull, DiskUnavailable
        If its numbers cannot be written.
    """
    header = _own_header(path, must_be_exr=is_master)
    with ExitStack() as kept:
        rows: ScratchRows | None = None
        for start, band in _decoded(path, header, _own_sandbox(), scratch):
            if rows is None:
                dtype = np.float16 if is_master else band.dtype
                aside = scratch_rows(scratch, rows=header.rows, cols=header.cols, channels=3, dtype=dtype)
                rows = kept.enter_context(aside)
            rows.write(start, band)
        assert rows is not None  # noqa: S101 - a picture has at least one row
        yield rows


def _numbers_of(path: Path, dtype: type[Light], channels: Sequence[str] = ()) -> NDArray[Light]:
    header = _own_header(path, must_be_exr=True)
    numbers = np.empty((header.rows, header.cols, len(channels) or 3), dtype=dtype)
    for start, band in _decoded(path, header, _own_sandbox(), channels=channels):
        numbers[start : start + len(band)] = band
    return numbers


def _own_header(path: Path, *, must_be_exr: bool) -> PictureHeader:
    """Return the header of a picture that may be as large as a frame of ours."""
    header = read_header(path, at_most_px=MAX_FRAME_PX**2, at_most_side_px=MAX_FRAME_PX)
    if must_be_exr and header.format != "EXR":
        raise ArtifactBroken(f"{path.name}: expected EXR, got {header.format}")
    return header


def _bounded_header(path: Path, at_most_px: int | None, page: int | None) -> PictureHeader:
    at_most_px = at_most_px or WorkerSettings().picture_px
    header = read_header(path, page=page or 0, at_most_px=at_most_px, at_most_side_px=MAX_FRAME_PX)
    if page is None and len(header.pages) > 1:
        raise ArtifactBroken(f"{path.name}: expected one picture, got {len(header.pages)} pages")
    return header


def _check_white_level(path: Path, header: PictureHeader, white_level: int | None) -> None:
    """Refuse a white level that no code of a picture can have."""
    if white_level is None or header.is_light:
        return
    if white_level > header.highest_code:
        raise ArtifactBroken(
            f"{path.name}: expected a white level of at most {header.highest_code}, the highest code of this"
            f" {header.format}, got {white_level}"
        )
    if header.white_is_zero:
        raise ArtifactBroken(f"{path.name}: expected no white level, as 0 is white in this TIFF, got {white_level}")


@cache
def _own_sandbox() -> Sandbox:
    settings = WorkerSettings()
    return replace(detect_once(settings.sandbox, cgroup=settings.cgroup), allow_none=True)


def _decoded(
    path: Path,
    header: PictureHeader,
    sandbox: Sandbox,
    scratch: Path | None = None,
    should_stop: Callable[[], bool] = _never,
    *,
    channels: Sequence[str] = (),
) -> Iterator[tuple[int, NDArray[Any]]]:
    """Yield the numbers of a picture in bands of rows, each with its first row; see `decoder`."""
    count = len(channels) or 3
    with tempfile.TemporaryDirectory(prefix="lippmann-picture-", dir=scratch) as folder:
        place = Path(folder).resolve()
        numbers = _decode(path, header, sandbox, place / "work", should_stop, channels)
        at_most = 4 * count * header.rows * header.cols
        try:
            pixels = take_result(place / "work", decoder.PIXELS, into=place, max_bytes=at_most)
        except RenderFailed as error:
            raise ArtifactBroken(f"{path.name}: {error.message}") from error
        if pixels is None:
            raise ArtifactBroken(f"{path.name}: expected numbers from the decoder, got no file")
        yield from _numbers(path, pixels, (header.rows, header.cols, count), np.dtype(_DTYPES[numbers]))


def _decode(
    path: Path,
    header: PictureHeader,
    sandbox: Sandbox,
    work: Path,
    should_stop: Callable[[], bool],
    named: Sequence[str],
) -> str:
    """Decode a picture inside the sandbox, in a new folder; return the type of its numbers."""
    work.mkdir()
    name = decoder.NAMES[header.format]
    # The sandbox may run its programs as a user who cannot read the original, and whose rights do not change.
    shutil.copyfile(path, work / name)
    shutil.copyfile(decoder.__file__, work / _DECODER)
    limits, times = _limits(header, path.stat().st_size, len(named) or 3)
    prefix = Path(sys.prefix).resolve()
    python = prefix / "bin" / Path(sys.executable).name
    argv = [str(python), "-I", "-B", _DECODER, name]
    argv += [str(header.pages[header.page]), str(header.rows), str(header.cols), *named]
    inside = sandbox.wrap(argv, readable=_readable(prefix), writable=work, limits=limits)
    with AttemptLog(work.with_name("log.txt")) as log:
        outcome = run(
            inside,
            cwd=work,
            env={"PATH": PATH, "LANG": "C.UTF-8", "OPENBLAS_NUM_THREADS": "1"},
            times=times,
            reader=_NoProgress(),
            on_progress=lambda _: None,
            should_stop=should_stop,
            log=log,
            limits=limits,
            groups=sandbox.groups,
        )
    last = outcome.lines[-1] if outcome.lines else ""
    if outcome.ending is Ending.EXITED and outcome.exit_code == 0 and last in _DTYPES:
        return last
    raise _error(path.name, outcome, last, times)


def _limits(header: PictureHeader, file_bytes: int, channels: int) -> tuple[Limits, TimeLimits]:
    """Return the limits of the decoder of a picture, from what its header says."""
    # A reader may hold the whole picture, as with an interlaced PNG or a TIFF of one strip, and a copy of it.
    held = max(header.decoded_bytes, header.block_px * header.pixel_bytes)
    written = header.rows * header.cols * channels * 4
    cpu_s = START_S + held / BYTES_PER_S
    limit = TimeLimit(WAIT * cpu_s, "the size of the picture")
    memory_mb = PROGRAM_MB + math.ceil(3 * held / _MIB)
    file_mb = 1 + math.ceil(written / _MIB)
    disk_mb = file_mb + 1 + math.ceil(file_bytes / _MIB)
    limits = Limits(cpu_s=cpu_s, memory_mb=memory_mb, file_mb=file_mb, disk_mb=disk_mb, files=20)
    return limits, TimeLimits(limit, limit)


def _readable(prefix: Path) -> list[Path]:
    """Return what the decoder reads besides its folder: Python with its libraries."""
    pythons = {prefix, Path(sys.base_prefix).resolve()}
    return [place for place in sorted(pythons) if not place.is_relative_to("/usr")]


def _error(name: str, outcome: Outcome[None], last: str, times: TimeLimits) -> LippmannError:
    if last.startswith((*COMPLAINTS, "prlimit: ")):
        return SandboxMissing(f"The sandbox did not start: {last[:300]}")
    if outcome.ending is Ending.STOPPED:
        return Stopped()
    if outcome.ending in (Ending.TOO_MUCH, Ending.TOO_MUCH_MEMORY):
        return ArtifactBroken(f"{name}: expected a picture that is decoded as its header says, got {outcome.excess}")
    code = outcome.exit_code
    if outcome.ending is not Ending.EXITED or code in (-signal.SIGXCPU, 128 + signal.SIGXCPU):
        return ArtifactBroken(f"{name}: expected a picture that is decoded within {times.total}, got one that is not")
    if code in (-signal.SIGXFSZ, 128 + signal.SIGXFSZ):
        return ArtifactBroken(f"{name}: expected as many numbers as the header says, got more")
    if code < 0 or code > 128:
        return RenderCrashed(
            f"{name}: The decoder of pictures was ended by signal {-code if code < 0 else code - 128}."
        )
    return ArtifactBroken(f"{name}: {last[:300] or f'the decoder ended with {code}'}")


def _numbers(path: Path, pixels: Path, shape: _Shape, dtype: np.dtype[Any]) -> Iterator[tuple[int, NDArray[Any]]]:
    """Yield the numbers that the decoder left, which may be anything, in bands of rows with their first row."""
    rows, cols, channels = shape
    row_bytes = cols * channels * dtype.itemsize
    size = pixels.stat().st_size
    if size != rows * row_bytes:
        raise ArtifactBroken(f"{path.name}: expected {rows * row_bytes} bytes from the decoder, got {size}")
    with pixels.open("rb") as file:
        for start, stop in bands_of_rows(rows, row_bytes):
            data = file.read((stop - start) * row_bytes)
            yield start, np.frombuffer(data, dtype=dtype).reshape(stop - start, cols, channels)


@dataclass(frozen=True)
class _NoProgress:
    """The decoder reports no progress."""

    progress: None = None
    phase: str = "decoding"
    growth: float = 0.0

    def read(self, line: str) -> bool:
        """Return False: every line is a result."""
        return False
