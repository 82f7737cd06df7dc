r"""The files that a scene names, and the names by which POV-Ray finds them.

Windows and macOS find `maps/wood.png` as `Maps/WOOD.png`, and Windows also as `maps\wood.png`. POV-Ray on Linux does
not. So each such name in a scene becomes a link to the file, in a folder that POV-Ray searches last: a file with
exactly the wanted name comes first. A name that a scene computes has no link, but the message about it names the file
that is there.
"""

from __future__ import annotations

import posixpath
import re
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache
from itertools import islice
from pathlib import Path

from lippmann.errors import ScratchDamaged
from lippmann.untrusted.file_names import plain_name
from worker.engines.povray.command import SYSTEM_INCLUDE
from worker.engines.povray.scene_variables import texts
from worker.sandbox.bundle import listing_of

LINKS_FOLDER = "lippmann-names"
"""The folder of the links, in the folder of the task."""

_QUOTED = re.compile(rb'"(?=([^"\r\n\0]{1,250})")')
"""A text between two quotation marks of a line, whichever of them opens a string: what is outside of strings names no
file."""
_MOST_QUOTED, _MOST_NAMES = 1_000_000, 20_000
"""The numbers of quoted texts, and of different ones, that are looked at, which takes a second at most."""
_MOST_LINKS = 2_000
"""The number of names that get a link, as many as a bundle has files. The message about another one names the file."""
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
        """Write a link for every name that the scene uses in another case or with backslashes.

        Parameters
        ----------
        folder
            The folder of the links, which may have them already.
        """
        folder.mkdir(exist_ok=True)
        for name, file in islice(self._links.items(), _MOST_LINKS):
            # A name that is both that of a file and that of a folder has one link, and POV-Ray reports the other.
            with suppress(FileExistsError, NotADirectoryError):
                (folder / name).parent.mkdir(parents=True, exist_ok=True)
                (folder / name).symlink_to(file)

    def own_name(self, name: str) -> str:
        """Return the name of a file by which POV-Ray found it, or that of the file behind a link."""
        file = self._links.get(name)
        if file is None:
            return name
        return file.relative_to(self.bundle).as_posix() if file.is_relative_to(self.bundle) else file.name

    def missing(self, name: str) -> str:
        """Return the message about a file that POV-Ray did not find, with the file of the bundle that may be meant."""
        wanted = _path(name)
        last = posixpath.basename(wanted)
        files = (path.relative_to(self.bundle).as_posix() for path in self.bundle.rglob("*") if path.is_file())
        alike = sorted(file for file in files if plain_name(posixpath.basename(file)) in (last, f"{last}{_INC}"))
        if not alike:
            return f"no file {name!r} in the scene bundle"
        found = next((file for file in alike if plain_name(f"/{file}").endswith(f"/{wanted}")), "")
        said = f"no file {name!r} where POV-Ray looks; the bundle has {found or alike[0]!r}"
        above = "/".join(found.split("/")[: -len(wanted.split("/"))])
        if above and self.bundle / above not in self.folders:
            return f'{said}: add include = ["{above}"] to scene.toml, at its top, or name the file so in the scene'
        return f"{said}: name the file so in the scene"

    @property
    def _links(self) -> Mapping[str, Path]:
        return _links(self.bundle, (*self.folders, SYSTEM_INCLUDE), listing_of(self.bundle))


@lru_cache(maxsize=64)
def _links(bundle: Path, folders: tuple[Path, ...], listing: str) -> Mapping[str, Path]:
    files: dict[str, Path] = {}
    for folder in reversed(folders):
        files |= _system_files() if folder == SYSTEM_INCLUDE else _files_in(folder)
    links = {}
    for name in _quoted(bundle):
        file = files.get(_path(name))
        if file is not None and not any((folder / name).is_file() for folder in folders):
            links[name] = file
    if listing_of(bundle) != listing:
        raise ScratchDamaged("files of the scene changed while they were read")
    return links


@lru_cache(maxsize=1)
def _system_files() -> Mapping[str, Path]:
    return _files_in(SYSTEM_INCLUDE)


def _files_in(folder: Path) -> Mapping[str, Path]:
    """Return the files of a folder by what their names have in common with others, and without the suffix .inc."""
    files = {plain_name(path.relative_to(folder).as_posix()): path for path in folder.rglob("*") if path.is_file()}
    return {name.removesuffix(_INC): path for name, path in files.items()} | files


def _quoted(bundle: Path) -> Iterator[str]:
    """Yield the quoted texts of a scene that may be relative names of files, each once."""
    seen: set[bytes] = set()
    found = (match[1] for _, data in texts(bundle) for match in _QUOTED.finditer(data))
    for quoted in islice(found, _MOST_QUOTED):
        if quoted in seen:
            continue
        if len(seen) == _MOST_NAMES:
            return
        seen.add(quoted)
        text = quoted.decode(errors="replace")
        for name in dict.fromkeys((text, text.replace("\\\\", "\\"))):
            if not name.startswith("/") and ".." not in name.split("/"):
                yield name


def _path(name: str) -> str:
    r"""Return what a name has in common with others, with single slashes.

    >>> _path("Maps\\WOOD.png"), _path("./maps//wood.png")
    ('maps/wood.png', 'maps/wood.png')
    """
    return plain_name(posixpath.normpath(re.sub(r"[/\\]+", "/", name)))
