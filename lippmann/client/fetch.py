"""A job's files brought here: what is here already, and whole, is passed over.

    out/integral/0001.png  orthoscopic/0001.png  views/0001.png  video/views.mp4 ...

Beside them `.fetched.json` says which file of the service each one is, by entity tag and size.
"""

from __future__ import annotations

import json
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Literal

from lippmann.client import Client
from lippmann.errors import BadInput
from lippmann.job.frames import parse_frames
from lippmann.terminal.progress import ProgressLine, size_text
from service.schemas.artifact import Artifact

RECORD = ".fetched.json"
SAVED_EVERY_S = 5.0
"""How often the record is written while files come."""
PICTURES = ("integral", "orthoscopic", "device", "views")
MASTERS_ONLY = ("depth",)
"""Numbers: no pictures."""
OUTPUTS = ("video", "exports")


@dataclass(frozen=True)
class Fetched:
    """A file that is here."""

    path: Path
    etag: str
    """Of the master that it was made from."""
    size: int


@dataclass(frozen=True)
class Haul:
    """What a fetch brought."""

    folder: Path
    files: tuple[Path, ...]
    """Everything of the job that is here now."""
    brought: int
    """How many of them came just now."""
    bytes_brought: int


def fetch_job(client: Client, job_id: str, folder: Path, *, frames: str | None = None, masters: bool = False) -> Haul:
    """Bring what is ready of a job into a folder: PNG pictures, or EXR masters, and all outputs.

    Raises
    ------
    BadInput
        If the folder cannot be written.
    """
    wanted = tuple(_wanted(client, job_id, frames, masters=masters))
    brought: list[Fetched] = []
    with _kept_record(folder) as record, ProgressLine(f"fetch {job_id}") as line:
        for number, artifact in enumerate(wanted):
            path = _place(artifact.name, masters=masters)
            if not _is_here(folder, record.known.get(path.as_posix()), artifact):
                fetched = _bring(client, job_id, artifact, folder, path)
                brought.append(fetched)
                record.note(path.as_posix(), fetched)
            total = size_text(sum(one.size for one in brought))
            count = number + 1
            line.show(count / len(wanted), f"{count} of {len(wanted)} files, {total}", news=count == len(wanted))
    files = tuple(folder / _place(artifact.name, masters=masters) for artifact in wanted)
    return Haul(folder, files, brought=len(brought), bytes_brought=sum(one.size for one in brought))


def _wanted(client: Client, job_id: str, frames: str | None, *, masters: bool) -> Iterator[Artifact]:
    numbers = set(parse_frames(frames)) if frames else None
    for kind in (*PICTURES, *MASTERS_ONLY) if masters else PICTURES:
        for artifact in client.artifacts(job_id, prefix=f"{kind}/"):
            stem = Path(artifact.name).stem
            if artifact.name.endswith(".exr") and (numbers is None or (stem.isdigit() and int(stem) in numbers)):
                yield artifact
    for folder in OUTPUTS:
        yield from client.artifacts(job_id, prefix=f"{folder}/")


def _place(name: str, *, masters: bool) -> Path:
    path = Path(name)
    if not path.parts or path.is_absolute() or ".." in path.parts:
        raise BadInput(f"expected files below the job, got {name!r} from the service")
    shown = path.suffix == ".exr" and path.parts[0] in PICTURES and not masters
    return path.with_suffix(".png") if shown else path


def _is_here(folder: Path, known: Fetched | None, artifact: Artifact) -> bool:
    if known is None or known.etag != artifact.etag:
        return False
    try:
        return (folder / known.path).stat().st_size == known.size
    except OSError:
        return False


def _bring(client: Client, job_id: str, artifact: Artifact, folder: Path, path: Path) -> Fetched:
    made: Literal["png"] | None = "png" if path.suffix != Path(artifact.name).suffix else None
    try:
        download = client.download(job_id, artifact.name, folder / path, format=made)
    except OSError as error:
        raise BadInput(f"expected a folder to write {folder / path}, got: {error.strerror}") from error
    return Fetched(path=path, etag=artifact.etag, size=download.size)


@dataclass
class _Record:
    """What is here, by place; on disk never much older than `SAVED_EVERY_S`, as it may be long."""

    folder: Path
    known: dict[str, Fetched]
    _saved_s: float
    _is_saved: bool = True

    def note(self, place: str, fetched: Fetched) -> None:
        """Note a file that came."""
        self.known[place], self._is_saved = fetched, False
        if time.monotonic() - self._saved_s > SAVED_EVERY_S:
            self.save()

    def save(self) -> None:
        """Write it down, unless it is."""
        if not self._is_saved:
            _write_record(self.folder, self.known)
            self._saved_s, self._is_saved = time.monotonic(), True


@contextmanager
def _kept_record(folder: Path) -> Iterator[_Record]:
    """Lend the record of a folder; it is written whatever ends the fetch."""
    record = _Record(folder, _read_record(folder), time.monotonic())
    try:
        yield record
    finally:
        record.save()


def _read_record(folder: Path) -> dict[str, Fetched]:
    try:
        data = json.loads((folder / RECORD).read_bytes())
        return {name: Fetched(Path(name), one["etag"], one["size"]) for name, one in data.items()}
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return {}  # a record that is lost costs downloads, nothing else


def _write_record(folder: Path, record: Mapping[str, Fetched]) -> None:
    beside = folder / f"{RECORD}.part"
    data = {name: {key: value for key, value in asdict(one).items() if key != "path"} for name, one in record.items()}
    beside.write_text(json.dumps(data, indent=1, sort_keys=True))
    beside.replace(folder / RECORD)


def haul_text(haul: Haul, *, most: int = 8) -> str:
    """Return what is here now, folder by folder."""
    folders: dict[Path, list[Path]] = {}
    for path in haul.files:
        folders.setdefault(path.parent, []).append(path)
    lines = [_folder_line(folder, paths) for folder, paths in folders.items()]
    head = f"{len(haul.files)} files in {haul.folder}, {haul.brought} of them new ({size_text(haul.bytes_brought)})"
    return "\n".join([head, *lines[:most]])


def _folder_line(folder: Path, paths: Sequence[Path]) -> str:
    names = [path.name for path in paths]
    return f"  {folder}/  " + (" ".join(names) if len(names) <= 3 else f"{names[0]} ... {names[-1]} ({len(names)})")
