r"""The files that a scene names, and the names by which POV-Ray finds them.

Windows and macOS find `maps/wood.png` as `Maps/WOOD.png`, and Windows also as `maps\wood.png`. POV-Ray on Linux does
not. Nor does it open a name outside ASCII, because it reads a blank in place of each byte that is not ASCII. So each
such name in a scene becomes a link to the file, in a folder that POV-Ray searches last: a file with exactly the wanted
name comes first. A name that a scene computes has no link, but the message about it names the file that is there.
"""

from __future__ import annotations

import posixpath
import re
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import islice
from pathlib import Path

from lippmann.errors import ScratchDamaged
from lippmann.untrusted.file_names import plain_name
from povtemplates import literals
from worker.engines.povray.command import SYSTEM_INCLUDE
from worker.engines.povray.scenes.scene_variables import texts
from worker.sandbox.bundle import listing_of

LINKS_FOLDER = "lippmann-names"
"""The folder of the links, in the folder of the task."""

_QUOTED = re.compile(rb'"(?=([^"\r\n\0]{1,250})")')
"""A text between two quotation marks of a line, whichever of them opens a string: what is outside of strings names no
file."""
_NOT_ASCII = re.compile(r"[^\0-\x7f]")
_MOST_QUOTED, _MOST_NAMES = 1_000_000, 20_000
"""The numbers of quoted texts, and of different ones, that are looked at, which takes a second at most."""
_MOST_LINKS = 2_000
"""The number of names that get a link, as many as a bundle has files. The message about another one names the file."""
_WINDOWS = "cp1252"
"""The encoding of a scene that is not in UTF-8."""
_INC = ".inc"
"""The suffix that a scene may leave out."""


@dataclass(frozen=True)
class SceneFiles:
    """The files of a scene bundle, and where POV-Ray looks for those that the scene names."""

    bundle: Path
    """The folder of the bundle, which never changes."""
    file: str
    """The scene file, relative to the bundle."""
    include: tuple[str, ...] = ()
    """The folders of the bundle that its manifest names."""

    @property
    def folders(self) -> tuple[Path, ...]:
        """The folders of the bundle that POV-Ray searches, in their order."""
        return tuple(self.bundle / name for name in (posixpath.dirname(self.file), "", *self.include))

    def make_links(self, folder: Path) -> None:
        """Write a link for every name that the scene uses in another case, with backslashes or outside ASCII.

        Parameters
        ----------
        folder
            The folder of the links, which may have them already.
        """
        folder.mkdir(exist_ok=True)
        for name, file in islice(self._read_links().items(), _MOST_LINKS):
            # A name that is both that of a file and that of a folder has one link, and POV-Ray reports the other.
            with suppress(FileExistsError, NotADirectoryError):
                (folder / name).parent.mkdir(parents=True, exist_ok=True)
                (folder / name).symlink_to(file)

    def found(self, name: str) -> Path | None:
        """Return the file that POV-Ray finds by a name of the scene; None without one."""
        there = (folder / name for folder in self.folders)
        return next((path for path in there if path.is_file()), self._links.get(name))

    def own_name(self, name: str) -> str:
        """Return the name of a file by which POV-Ray found it, or that of the file behind a link."""
        file = self._links.get(name)
        if file is None:
            return name
        return file.relative_to(self.bundle).as_posix() if file.is_relative_to(self.bundle) else file.name

    def missing(self, name: str) -> str:
        """Return the message about a file that POV-Ray did not find, with the file of the bundle that may be meant."""
        meant = self._meant.get(name, name)
        wanted = _path(meant)
        last = posixpath.basename(wanted)
        files = (path.relative_to(self.bundle).as_posix() for path in self.bundle.rglob("*") if path.is_file())
        alike = sorted(file for file in files if plain_name(posixpath.basename(file)) in (last, f"{last}{_INC}"))
        if not alike:
            return f"no file {meant!r} in the scene bundle"
        found = next((file for file in alike if plain_name(f"/{file}").endswith(f"/{wanted}")), "")
        said = f"no file {meant!r} where POV-Ray looks; the bundle has {found or alike[0]!r}"
        above = "/".join(found.split("/")[: -len(wanted.split("/"))])
        if above.isascii() and above and self.bundle / above not in self.folders:
            return f'{said}: add include = ["{above}"] to scene.toml, at its top, or name the file so in the scene'
        if not meant.isascii() and found:
            return f"{said}: POV-Ray reads a letter outside ASCII as a blank, so give the file a name of ASCII letters"
        return f"{said}: name the file so in the scene"

    @cached_property
    def _links(self) -> Mapping[str, Path]:
        """The links, read once: POV-Ray can print thousands of messages, and a bundle can have thousands of files."""
        return self._read_links()

    def _read_links(self) -> Mapping[str, Path]:
        return _links(self.bundle, (*self.folders, SYSTEM_INCLUDE), listing_of(self.bundle), self.file)

    @cached_property
    def _meant(self) -> Mapping[str, str]:
        """The names outside ASCII that the scene has, by how POV-Ray reports them."""
        return {name: meant for name, meant in _quoted(self.bundle) if not meant.isascii()}


@lru_cache(maxsize=64)
def _links(bundle: Path, folders: tuple[Path, ...], listing: str, scene: str) -> Mapping[str, Path]:
    files: dict[str, Path] = {}
    for folder in reversed(folders):
        files |= _system_files() if folder == SYSTEM_INCLUDE else _files_in(folder)
    links = {} if scene.isascii() else {literals.file_name(posixpath.basename(scene)): bundle / scene}
    unclear = set()
    for name, meant in _quoted(bundle):
        file = files.get(_path(meant))
        if file is None or any((folder / name).is_file() for folder in folders):
            continue
        if links.setdefault(name, file) != file:
            unclear.add(name)
    if listing_of(bundle) != listing:
        raise ScratchDamaged("files of the scene changed while they were read")
    return {name: file for name, file in links.items() if name not in unclear}


@lru_cache(maxsize=1)
def _system_files() -> Mapping[str, Path]:
    return _files_in(SYSTEM_INCLUDE)


def _files_in(folder: Path) -> Mapping[str, Path]:
    """Return the files of a folder by what their names have in common with others, and without the suffix .inc."""
    files = {plain_name(path.relative_to(folder).as_posix()): path for path in folder.rglob("*") if path.is_file()}
    return {name.removesuffix(_INC): path for name, path in files.items()} | files


def _quoted(bundle: Path) -> Iterator[tuple[str, str]]:
    """Yield the quoted texts of a scene that may be relative names of files, as POV-Ray reads them and as they are."""
    seen: set[bytes] = set()
    found = (match[1] for _, data in texts(bundle) for match in _QUOTED.finditer(data))
    for quoted in islice(found, _MOST_QUOTED):
        if quoted in seen:
            continue
        if len(seen) == _MOST_NAMES:
            return
        seen.add(quoted)
        for read, meant in _readings(quoted):
            if not meant.startswith("/") and ".." not in meant.split("/"):
                yield read, meant


def _readings(quoted: bytes) -> Iterator[tuple[str, str]]:
    r"""Yield how POV-Ray reads a name, and the name: with each byte outside ASCII blank, or each character as UTF-8.

    >>> list(_readings("maps/Öl.png".encode()))
    [('maps/  l.png', 'maps/Öl.png'), ('maps/ l.png', 'maps/Öl.png')]
    """
    try:
        text = quoted.decode()
    except UnicodeDecodeError:
        text = quoted.decode(_WINDOWS, errors="replace")
    reads = dict.fromkeys((_NOT_ASCII.sub(" ", quoted.decode("latin-1")), _NOT_ASCII.sub(" ", text)))
    for read in reads:
        # Each backslash of a string may be written twice.
        yield from dict.fromkeys(((read, text), (read.replace(r"\\", "\\"), text.replace(r"\\", "\\"))))


def _path(name: str) -> str:
    r"""Return what a name has in common with others, with single slashes.

    >>> _path("Maps\\WOOD.png"), _path("./maps//wood.png")
    ('maps/wood.png', 'maps/wood.png')
    """
    return plain_name(posixpath.normpath(re.sub(r"[/\\]+", "/", name)))
