"""Files of imaging lenses: a prescription as a job takes it, from JSON, CSV, Zemax .zmx or CODE V .seq."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from lippmann.errors import BadInput, OpticsError, SpecError
from lippmann.untrusted.json_text import read_json

if TYPE_CHECKING:
    from lippmann.optics.lens_files.glasses.agf import Catalogue
    from lippmann.optics.lens_files.lens_file import LensFile

SUFFIXES = (".json", ".csv", ".zmx", ".seq")
CATALOGUE_SUFFIX = ".agf"
MAX_BYTES = 4_000_000
"""A design of some thousand surfaces, or a catalogue of some thousand glasses: more is another kind of file."""
MAX_CATALOGUES = 20
DOS_END = "\x1a"
"""The last character of a text file of DOS."""


def read_lens(path: Path, catalogues: Sequence[Path] = ()) -> LensFile:
    """Return the lens in a file, checked as the lens of a job is.

    Parameters
    ----------
    path
        The path of the file, whose suffix gives the format.
    catalogues
        The paths of glass catalogues (.agf), which count before the built-in table, in their order.

    Raises
    ------
    BadInput
        If a file cannot be read.
    SpecError
        If it holds no lens that can be modelled: line, field, what was expected, what came.
    """
    from lippmann.optics.lens_files.lens_file import check_lens_file

    if path.suffix.lower() not in SUFFIXES:
        raise BadInput(f"expected a lens as {', '.join(SUFFIXES)}, got {path.name}")
    if len(catalogues) > MAX_CATALOGUES:
        raise BadInput(f"expected at most {MAX_CATALOGUES} catalogues, got {len(catalogues)}")
    data = _bytes(path, "a lens file")
    known = [read_catalogue(catalogue) for catalogue in catalogues]
    try:
        file = parse_lens(path, data, known)
        check_lens_file(file)
    except SpecError as error:
        raise _of_file(error, path) from error
    return file


def read_catalogue(path: Path) -> Catalogue:
    """Return the glasses of a catalogue file.

    Parameters
    ----------
    path
        The path of the file.

    Raises
    ------
    BadInput, SpecError
        The same as for `read_lens`.
    """
    if path.suffix.lower() != CATALOGUE_SUFFIX:
        raise BadInput(f"expected a glass catalogue as {CATALOGUE_SUFFIX}, got {path.name}")
    try:
        return parse_catalogue(path, _bytes(path, "a glass catalogue"))
    except SpecError as error:
        raise _of_file(error, path) from error


def parse_lens(path: Path, data: bytes, catalogues: Sequence[Catalogue] = ()) -> LensFile:
    """Return the lens in the content of a file, not yet checked.

    Parameters
    ----------
    path
        The path of the file, whose suffix gives the format.
    data
        The content.
    catalogues
        The glass catalogues that count before the built-in table.

    Raises
    ------
    BadInput, SpecError
        The same as for `read_lens`.
    """
    from lippmann.optics.lens_files.codev.prescription import read_lens_seq
    from lippmann.optics.lens_files.csv_files import read_lens_csv
    from lippmann.optics.lens_files.glasses.search import GlassSearch
    from lippmann.optics.lens_files.zemax.prescription import read_lens_zmx

    suffix = path.suffix.lower()
    if suffix == ".zmx":
        return read_lens_zmx(_foreign_text(data), GlassSearch(catalogues))
    if suffix == ".seq":
        return read_lens_seq(_foreign_text(data), GlassSearch(catalogues))
    if suffix == ".csv":
        return read_lens_csv(_text(path, data), GlassSearch(catalogues), title=path.stem)
    return _read_json(path, data)


def parse_catalogue(path: Path, data: bytes) -> Catalogue:
    """Return the glasses in the content of a catalogue.

    Parameters
    ----------
    path
        The path of the file, whose name is the title of the catalogue.
    data
        The content.

    Raises
    ------
    BadInput, SpecError
        The same as for `read_lens`.
    """
    from lippmann.optics.lens_files.glasses.agf import read_agf

    return read_agf(_foreign_text(data), title=path.name)


def _read_json(path: Path, data: bytes) -> LensFile:
    from pydantic import ValidationError

    from lippmann.job.fields.problems import problems_of
    from lippmann.job.optics.lens import Prescription
    from lippmann.optics.lens_files.lens_file import LensFile

    try:
        prescription = Prescription.model_validate(read_json(data, field=str(path)))
    except ValidationError as error:
        raise SpecError.of(problems_of(error)) from error
    return LensFile(prescription, tuple(f"surfaces.{place}" for place in range(len(prescription.surfaces))))


def _of_file(error: SpecError, path: Path) -> SpecError:
    """Return the error with the name of the file before its message."""
    kind = OpticsError if isinstance(error, OpticsError) else SpecError
    named = kind(f"{path.name}: {error.message}")
    named.problems = error.problems
    return named


def _bytes(path: Path, what: str) -> bytes:
    try:
        with path.open("rb") as file:
            data = file.read(MAX_BYTES + 1)
    except OSError as error:
        raise BadInput(f"expected {what}, got {path}: {error.strerror}") from error
    if len(data) > MAX_BYTES:
        raise BadInput(f"{path}: expected {what} of at most {MAX_BYTES:,} bytes, got more")
    return data


def _text(path: Path, data: bytes) -> str:
    try:
        return data.decode("utf-8-sig").rstrip(DOS_END)
    except UnicodeDecodeError as error:
        raise BadInput(f"{path}: expected text in UTF-8, got {error}") from error


def _foreign_text(data: bytes) -> str:
    """Return the text of a design program: newer files are UTF-16, older ones the code page of their machine."""
    return _decoded(data).rstrip(DOS_END)


def _decoded(data: bytes) -> str:
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return data.decode("utf-16", errors="replace")
    if data[:1] == b"\0" or data[1:2] == b"\0":
        return data.decode("utf-16-be" if data[:1] == b"\0" else "utf-16-le", errors="replace")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        # The code page of western Windows; in Latin-1 its dashes and quotation marks would be control characters.
        return data.decode("cp1252", errors="replace")
