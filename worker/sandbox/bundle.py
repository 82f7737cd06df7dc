"""Scene bundles: a folder or a zip of scene.toml, the .inc or .pov that it names, and what they use.

The zip is deterministic, so that its SHA-256 names the scene: same files, same name.
"""

from __future__ import annotations

import hashlib
import io
import zipfile
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from lippmann.errors import BundleError
from lippmann.job.scene import SceneManifest, parse_scene
from povtemplates.catalogue import MANIFEST, POSTER
from povtemplates.manifest import ManifestError, read_manifest

MAX_BYTES = 256 * 1024 * 1024
"""The limit of all files together, unpacked."""
MAX_FILES = 2000
MAX_POSTER_BYTES = 2 * 1024 * 1024
MAX_MANIFEST_BYTES = 256 * 1024
MAX_NAME_BYTES = 200
"""The limit of one part of a name; file systems take 255."""

OURS = "lippmann-"
"""The prefix of the files that a worker writes beside the scene; POV-Ray finds those first."""

_ENCRYPTED = 0x1
_METHODS = {zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED}
_CHUNK = 64 * 1024

_EPOCH = (1980, 1, 1, 0, 0, 0)


@dataclass(frozen=True)
class CheckedBundle:
    """A bundle that was checked."""

    card: SceneManifest
    digest: str
    poster: bytes | None
    """PNG."""


def pack_folder(folder: Path) -> bytes:
    """Return the bundle in a folder as a deterministic zip; hidden files and byte code stay out.

    Raises
    ------
    BundleError
        If the folder is not there, a link in it leads out of it, or the name of a file is not UTF-8.
    """
    if not folder.is_dir():
        raise BundleError(f"expected a folder with {MANIFEST} and a scene, got {folder}")
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for path in _files_of(folder):
            name = path.relative_to(folder).as_posix()
            if not _is_utf8(name):
                raise BundleError(f"expected file names in UTF-8 in {folder}, got {name!a}")
            entry = zipfile.ZipInfo(name, _EPOCH)
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, path.read_bytes())
    return packed.getvalue()


def _is_utf8(name: str) -> bool:
    try:
        name.encode("utf-8")
    except UnicodeEncodeError:
        return False
    return True


def check_bundle(data: bytes) -> CheckedBundle:
    """Check a zip before any part of it is used.

    Raises
    ------
    BundleError
        If it is not a zip, is too large, has names outside its folder, or lacks a valid scene.toml or its scene.
    """
    with _opened(data) as archive:
        names = _checked_names(archive)
        card = _card(archive, names)
        poster = _read(archive, POSTER, at_most=MAX_POSTER_BYTES) if POSTER in names else None
        for name in names:
            _read(archive, name, at_most=MAX_BYTES)
    return CheckedBundle(card=card, digest=digest_of(data), poster=poster)


def unpack(data: bytes, folder: Path) -> None:
    """Write a checked bundle's files into an empty folder.

    Raises
    ------
    BundleError
        The same as for `check_bundle`.
    """
    with _opened(data) as archive:
        for name in _checked_names(archive):
            target = folder / name
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(_read(archive, name, at_most=MAX_BYTES))


def digest_of(data: bytes) -> str:
    """Return the SHA-256 of a bundle, which names it."""
    return hashlib.sha256(data).hexdigest()


def _card(archive: zipfile.ZipFile, names: list[str]) -> SceneManifest:
    if MANIFEST not in names:
        raise BundleError(f"expected {MANIFEST} at the top of the bundle, got {_some(names) or 'no file'}")
    try:
        card = parse_scene(read_manifest(_read(archive, MANIFEST, at_most=MAX_MANIFEST_BYTES)))
    except ManifestError as error:
        raise BundleError(str(error)) from error
    if card.sheets is not None:
        return card.model_copy(update={"sheets": card.sheets.with_files(names)})
    if card.file not in names:
        raise BundleError(
            f"{MANIFEST}: file: expected one that is in the bundle, got {card.file!r}; there are {_some(names)}"
        )
    _check_not_ours(card.file, names)
    return card


def _check_not_ours(scene: str, names: list[str]) -> None:
    """Refuse a file with the prefix of the worker's own files in a folder that POV-Ray searches."""
    searched = {PurePosixPath(scene).parent, PurePosixPath()}
    for path in map(PurePosixPath, names):
        if path.parent in searched and path.name.lower().startswith(OURS):
            raise BundleError(f"expected no name beside the scene that begins with {OURS!r}, got {str(path)!r}")


def _some(names: list[str]) -> str:
    """Return up to eight names, scenes first, for a message."""
    ranked = sorted(names, key=lambda name: (not name.lower().endswith((".pov", ".inc")), name))
    return ", ".join(ranked[:8])


def _files_of(folder: Path) -> Iterator[Path]:
    inside = folder.resolve()
    for path in sorted(folder.rglob("*")):
        parts = path.relative_to(folder).parts
        if not path.is_file() or any(part.startswith(".") or part == "__pycache__" for part in parts):
            continue
        if not path.resolve().is_relative_to(inside):
            raise BundleError(f"expected files inside the bundle, got a link that leads out: {path}")
        yield path


def _opened(data: bytes) -> zipfile.ZipFile:
    try:
        return zipfile.ZipFile(io.BytesIO(data))
    except zipfile.BadZipFile as error:
        raise BundleError(f"expected a zip, got {len(data)} bytes that are not one") from error


def _checked_names(archive: zipfile.ZipFile) -> list[str]:
    entries = [entry for entry in archive.infolist() if not entry.is_dir()]
    if len(entries) > MAX_FILES:
        raise BundleError(f"expected at most {MAX_FILES} files, got {len(entries)}")
    size = sum(entry.file_size for entry in entries)
    if size > MAX_BYTES:
        raise BundleError(f"expected at most {MAX_BYTES} bytes unpacked, got {size}")
    for entry in entries:
        path = PurePosixPath(entry.filename)
        if path.is_absolute() or ".." in path.parts or "\\" in entry.filename or "\0" in entry.filename:
            raise BundleError(f"expected names inside the bundle, got {entry.filename!r}")
        if any(len(part.encode()) > MAX_NAME_BYTES for part in path.parts):
            raise BundleError(f"expected names of at most {MAX_NAME_BYTES} bytes, got {entry.filename[:80]!r}...")
        if entry.compress_type not in _METHODS or entry.flag_bits & _ENCRYPTED:
            raise BundleError(f"{entry.filename}: expected it stored or deflated and not encrypted")
        if entry.external_attr >> 16 & 0o170000 == 0o120000:
            raise BundleError(f"expected plain files, got a link: {entry.filename!r}")
    names = [entry.filename for entry in entries]
    _check_no_conflict(names)
    return names


def _check_no_conflict(names: list[str]) -> None:
    """Refuse a name that occurs twice, or that is both a file and a folder."""
    folders = {str(parent) for name in names for parent in PurePosixPath(name).parents}
    if len(set(names)) < len(names) or folders.intersection(names):
        raise BundleError("expected every name once, and none both as a file and as a folder")


def _read(archive: zipfile.ZipFile, name: str, *, at_most: int) -> bytes:
    """Return a file of the zip, reading no more than its declared size: a small zip may unpack to any size."""
    declared = archive.getinfo(name).file_size
    if declared > at_most:
        raise BundleError(f"{name}: expected at most {at_most} bytes, got {declared}")
    data = bytearray()
    try:
        with archive.open(name) as file:
            while chunk := file.read(_CHUNK):
                data += chunk
                if len(data) > declared:
                    raise BundleError(f"{name}: expected the {declared} bytes that the zip says, got more")
    except (zipfile.BadZipFile, zlib.error, EOFError, OSError) as error:
        raise BundleError(f"{name}: damaged in the zip: {error}") from error
    return bytes(data)
