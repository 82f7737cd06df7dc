"""Files of imaging lenses: a prescription as a job takes it, from JSON, CSV or Zemax .zmx."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from lippmann.errors import BadInput
from lippmann.untrusted.json_text import read_json

if TYPE_CHECKING:
    from lippmann.job.lens import Prescription

SUFFIXES = (".json", ".csv", ".zmx")
MAX_BYTES = 4_000_000
"""A design of some thousand surfaces: more is another kind of file."""


def read_lens(path: Path) -> dict[str, Any]:
    """Return the prescription in a file, as `rig.imaging_lens` of a job takes it.

    Raises
    ------
    BadInput
        If it cannot be read.
    SpecError
        If it holds no lens that can be modelled: line, field, what was expected, what came.
    """
    return read_prescription(path).model_dump(mode="json", exclude_defaults=True)


def read_prescription(path: Path) -> Prescription:
    """Return the prescription in a file, whose suffix gives the format."""
    if path.suffix.lower() not in SUFFIXES:
        raise BadInput(f"expected a lens as {', '.join(SUFFIXES)}, got {path.name}")
    return parse_prescription(path, _bytes(path))


def parse_prescription(path: Path, data: bytes) -> Prescription:
    """Return the prescription in the content of a file.

    Parameters
    ----------
    path
        The path of the file, whose suffix gives the format.
    data
        The content.

    Raises
    ------
    BadInput, SpecError
        The same as for `read_lens`.
    """
    from lippmann.optics.lens.csv_files import read_lens_csv
    from lippmann.optics.lens.zemax_files import read_lens_zmx

    suffix = path.suffix.lower()
    if suffix == ".zmx":
        return read_lens_zmx(_zmx_text(data))
    return read_lens_csv(_text(path, data), title=path.stem) if suffix == ".csv" else _read_json(path, data)


def _read_json(path: Path, data: bytes) -> Prescription:
    from pydantic import ValidationError

    from lippmann.errors import SpecError
    from lippmann.job.lens import Prescription
    from lippmann.job.problems import problems_of

    try:
        return Prescription.model_validate(read_json(data, field=str(path)))
    except ValidationError as error:
        raise SpecError.of(problems_of(error)) from error


def _bytes(path: Path) -> bytes:
    try:
        with path.open("rb") as file:
            data = file.read(MAX_BYTES + 1)
    except OSError as error:
        raise BadInput(f"expected a lens file, got {path}: {error.strerror}") from error
    if len(data) > MAX_BYTES:
        raise BadInput(f"{path}: expected a lens file of at most {MAX_BYTES:,} bytes, got more")
    return data


def _text(path: Path, data: bytes) -> str:
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise BadInput(f"{path}: expected text in UTF-8, got {error}") from error


def _zmx_text(data: bytes) -> str:
    """Return the text of a .zmx file: newer ones are UTF-16, older ones the code page of their machine."""
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return data.decode("utf-16", errors="replace")
    if data[1:2] == b"\0":
        return data.decode("utf-16-le", errors="replace")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")
