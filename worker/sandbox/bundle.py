"""Scene bundles: a folder or a zip of scene.toml, the scene file that it names, and what they use.

The zip is deterministic, so that its SHA-256 names the scene: same files, same name.
"""

from __future__ import annotations

import hashlib
import io
import json
import os
import posixpath
import zipfile
from codecs import BOM_UTF8
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import NoReturn

from lippmann.errors import BundleError, InvalidText
from lippmann.job.rendering.engines import MITSUBA_FILES, POVRAY_FILES
from lippmann.job.scenes.scene import SceneManifest, parse_scene
from lippmann.untrusted.file_names import MAX_DEPTH, is_clutter, plain_name
from lippmann.untrusted.toml_text import MAX_BYTES as MAX_MANIFEST_BYTES
from lippmann.untrusted.toml_text import read_toml
from lippmann.untrusted.zip_archive import MAX_BYTES, MAX_FILES, Archive, open_archive
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
    notes: tuple[str, ...] = ()
    """The names in the zip that are not in the bundle."""


def pack_folder(folder: Path, *, manifest: bytes | None = None) -> bytes:
    """Return the bundle in a folder as a deterministic zip; hidden files, byte code and files of systems stay out.

    Parameters
    ----------
    folder
        The folder.
    manifest
        The scene.toml; None for the one in the folder.

    Raises
    ------
    BundleError
        If the folder is not there or cannot be read, has no scene.toml, is too large for a bundle, has a link that
        leads out of it, to nothing or to a folder, or the name of a file is not UTF-8.
    """
    if not folder.is_dir():
        raise BundleError(f"expected a folder with {MANIFEST} and a scene, got {folder}")
    if manifest is None:
        _check_manifest(folder)
    files = {path.relative_to(folder).as_posix(): path for path in _files_of(folder)}
    if manifest is not None:
        files.setdefault(MANIFEST, folder / MANIFEST)
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, path in files.items():
            if not _is_utf8(name):
                raise BundleError(f"expected file names in UTF-8 in {folder}, got {name!a}")
            entry = zipfile.ZipInfo(name, _EPOCH)
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, manifest if manifest is not None and name == MANIFEST else path.read_bytes())
    return packed.getvalue()


def _check_manifest(folder: Path) -> None:
    """Check that a folder has a manifest, or nothing but one folder, before any of its files is read."""
    try:
        there = [path for path in folder.iterdir() if not _stays_out(path.name)]
    except OSError as error:
        _refuse_unreadable(error)
    if folder / MANIFEST in there or (len(there) == 1 and there[0].is_dir()):
        return
    names = [path.name for path in there] + [f"{path.name}/{MANIFEST}" for path in there if (path / MANIFEST).is_file()]
    got = _manifest_elsewhere([os.fsencode(name).decode(errors="replace") for name in names])
    raise BundleError(f"expected {MANIFEST} at the top of the bundle, got {got}")


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
    with _opened(data) as (archive, notes):
        card = _card(archive)
        poster = archive.read(POSTER, at_most=MAX_POSTER_BYTES) if POSTER in archive.names else None
        archive.verify()
    return CheckedBundle(card=card, digest=digest_of(data), poster=poster, notes=notes)


def unpack(data: bytes, folder: Path) -> None:
    """Write a checked bundle's files into an empty folder, without the byte order marks of texts and with the date 0.

    POV-Ray skips the mark of the file that it is started with, and refuses that of an include file.

    Raises
    ------
    BundleError
        The same as for `check_bundle`.
    """
    with _opened(data) as (archive, _):
        archive.extract(folder)
        names = archive.names
    for path in (folder / name for name in names):
        with path.open("rb") as file:
            is_marked = file.read(len(BOM_UTF8)) == BOM_UTF8
        if is_marked:
            path.write_bytes(path.read_bytes().removeprefix(BOM_UTF8))
        os.utime(path, (0, 0))


@contextmanager
def _opened(data: bytes) -> Iterator[tuple[Archive, tuple[str, ...]]]:
    """Yield the archive of a bundle, and notes: a top folder that holds all files is the bundle."""
    with open_archive(data) as archive:
        notes = [f"the zip also has files that no scene uses: {_some(archive.ignored)}"] if archive.ignored else []
        top = _top_folder(archive.names)
        if top:
            archive.enter(top)
            notes.append(f"the bundle is the folder {top!r} of the zip")
        yield archive, tuple(notes)


def _top_folder(names: list[str]) -> str:
    """Return the deepest folder that holds all files, or nothing if that is the top of the zip.

    >>> _top_folder(["fish-main/scene.toml", "fish-main/maps/a.png"]), _top_folder(["scene.toml", "maps/a.png"])
    ('fish-main', '')
    """
    return posixpath.commonpath([posixpath.dirname(name) for name in names]) if names else ""


def listing_of(folder: Path) -> str:
    """Return what `unpack` left in a folder: the name, size and date of every file, as JSON.

    Two that unpack the same bundle make the same listing, as every file has the date 0. A file that was removed, cut
    or written to later makes another one.
    """
    found = [(path.relative_to(folder).as_posix(), path.stat()) for path in folder.rglob("*") if path.is_file()]
    return json.dumps({name: [known.st_size, known.st_mtime_ns] for name, known in sorted(found)})


def digest_of(data: bytes) -> str:
    """Return the SHA-256 of a bundle, which names it."""
    return hashlib.sha256(data).hexdigest()


def _card(archive: Archive) -> SceneManifest:
    names = archive.names
    if MANIFEST not in names:
        raise BundleError(f"expected {MANIFEST} at the top of the bundle, got {_manifest_elsewhere(names)}")
    try:
        card = parse_scene(read_toml(archive.read(MANIFEST, at_most=MAX_MANIFEST_BYTES), field=MANIFEST))
    except InvalidText as error:
        raise BundleError(error.message) from error
    if card.sheets is not None:
        return card.model_copy(update={"sheets": card.sheets.with_files(names)})
    folders = sorted({str(folder) for name in names for folder in PurePosixPath(name).parents} - {"."})
    card = card.model_copy(
        update={
            "file": _present(card.file, names, field="file"),
            "include": tuple(_present(folder, folders, field="include") for folder in card.include),
        }
    )
    _check_not_ours(card, names)
    return card


def _present(wanted: str, names: list[str], *, field: str) -> str:
    """Return the name in the bundle that the manifest means, which may have another case."""
    if wanted in names:
        return wanted
    for name in names:
        if plain_name(name) == plain_name(wanted):
            return name
    kind = "a folder" if field == "include" else "one"
    there = f"there are {_some(names)}" if names else "there is none"
    raise BundleError(f"{MANIFEST}: {field}: expected {kind} that is in the bundle, got {wanted!r}; {there}")


def _manifest_elsewhere(names: list[str]) -> str:
    """Return where in a bundle without a manifest at its top there is one, for a message."""
    below = sorted(name for name in names if posixpath.basename(name).lower() == MANIFEST)
    return f"it at {', '.join(map(repr, below[:3]))}" if below else _some(names) or "no file"


def _check_not_ours(card: SceneManifest, names: list[str]) -> None:
    """Refuse a file with the prefix of the worker's own files in a folder that POV-Ray searches."""
    searched = {PurePosixPath(card.file).parent, PurePosixPath(), *map(PurePosixPath, card.include)}
    for path in map(PurePosixPath, names):
        if path.parent in searched and path.name.lower().startswith(OURS):
            raise BundleError(f"expected no name beside the scene that begins with {OURS!r}, got {str(path)!r}")


def _some(names: list[str]) -> str:
    """Return up to eight names, scenes first, for a message."""
    ranked = sorted(names, key=lambda name: (not name.lower().endswith((*POVRAY_FILES, *MITSUBA_FILES)), name))
    return ", ".join(ranked[:8])


def _files_of(folder: Path) -> list[Path]:
    """Return the files of a bundle in their order; no more of a folder is looked at than a bundle may hold."""
    found: list[Path] = []
    size = 0
    for top, folders, names in os.walk(folder, onerror=_refuse_unreadable):
        folders[:] = [name for name in folders if not _stays_out(name)]
        for path in (Path(top) / name for name in (*folders, *names) if not _stays_out(name)):
            if path.is_symlink():
                _check_link(path, folder.resolve())
            if not path.is_file():
                continue
            found.append(path)
            size += path.stat().st_size
            if len(found) > MAX_FILES:
                raise BundleError(f"expected a folder of at most {MAX_FILES} files, got more in {folder}")
            if size > MAX_BYTES:
                raise BundleError(f"expected a folder of at most {MAX_BYTES} bytes, got more in {folder}")
        if len(Path(top).relative_to(folder).parts) >= MAX_DEPTH:
            raise BundleError(f"expected names of at most {MAX_DEPTH} parts, got {top}")
    return sorted(found)


def _stays_out(name: str) -> bool:
    return name.startswith(".") or name == "__pycache__" or is_clutter(name)


def _refuse_unreadable(error: OSError) -> NoReturn:
    raise BundleError(f"expected a folder that can be read, got {error.filename}: {error.strerror}") from error


def _check_link(path: Path, inside: Path) -> None:
    if path.is_dir():
        raise BundleError(f"expected a folder, got a link to one: {path}; put the folder itself there")
    if not path.exists():
        raise BundleError(f"expected a file, got a link to nothing: {path}")
    if not path.resolve().is_relative_to(inside):
        raise BundleError(f"expected files inside the bundle, got a link that leads out: {path}")
