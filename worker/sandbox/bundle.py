"""Scene bundles: a folder or a zip of scene.toml, the .inc or .pov that it names, and what they use.

The zip is deterministic, so that its SHA-256 names the scene: same files, same name.
"""

from __future__ import annotations

import hashlib
import io
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from lippmann.errors import BundleError, InvalidText
from lippmann.job.scene import SceneManifest, parse_scene
from lippmann.untrusted.toml_text import MAX_BYTES as MAX_MANIFEST_BYTES
from lippmann.untrusted.toml_text import read_toml
from lippmann.untrusted.zip_archive import MAX_BYTES, Archive, open_archive
from povtemplates.catalogue import MANIFEST, POSTER

MAX_POSTER_BYTES = 2 * 1024 * 1024

OURS = "lippmann-"
"""The prefix of the files that a worker writes beside the scene; POV-Ray finds those first."""

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
    with open_archive(data) as archive:
        card = _card(archive)
        poster = archive.read(POSTER, at_most=MAX_POSTER_BYTES) if POSTER in archive.names else None
        archive.verify()
    return CheckedBundle(card=card, digest=digest_of(data), poster=poster)


def unpack(data: bytes, folder: Path) -> None:
    """Write a checked bundle's files into an empty folder.

    Raises
    ------
    BundleError
        The same as for `check_bundle`.
    """
    with open_archive(data) as archive:
        archive.extract(folder)


def is_unpacked(data: bytes, folder: Path) -> bool:
    """Return whether a folder still has all of a bundle's files, with the same bytes."""
    with open_archive(data) as archive:
        return all(_has(folder / name, archive.read(name, at_most=MAX_BYTES)) for name in archive.names)


def digest_of(data: bytes) -> str:
    """Return the SHA-256 of a bundle, which names it."""
    return hashlib.sha256(data).hexdigest()


def _card(archive: Archive) -> SceneManifest:
    names = archive.names
    if MANIFEST not in names:
        raise BundleError(f"expected {MANIFEST} at the top of the bundle, got {_some(names) or 'no file'}")
    try:
        card = parse_scene(read_toml(archive.read(MANIFEST, at_most=MAX_MANIFEST_BYTES), field=MANIFEST))
    except InvalidText as error:
        raise BundleError(error.message) from error
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


def _has(path: Path, content: bytes) -> bool:
    try:
        return path.read_bytes() == content
    except OSError:
        return False


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
