"""Download the files of a job; files that are complete in the folder already are skipped.

    out/integral/0001.png  orthoscopic/0001.png  views/0001.png  video/views.mp4 ...

The file `.fetched.json` in the same folder records the entity tag and the size of every downloaded file. If the job has
not made everything, `missing.json` says what is missing and why; see `lippmann.client.missing`.
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
from lippmann.client.errors import Refused
from lippmann.client.missing import Missing, find_missing, read_state, write_missing
from lippmann.errors import ArtifactBroken, ArtifactMissing, BadInput
from lippmann.job.frames import parse_frames
from lippmann.terminal.progress import ProgressLine, size_text
from service.schemas.artifact import Artifact

RECORD = ".fetched.json"
SAVED_EVERY_S = 5.0
"""The interval at which the record is written while files are downloaded, s."""
PICTURES = ("integral", "orthoscopic", "device", "views")
MASTERS_ONLY = ("depth",)
"""These hold numbers, so no PNG picture is made of them."""
OUTPUTS = ("video", "exports")
_DAMAGED = frozenset({ArtifactBroken.code, ArtifactMissing.code})
"""The codes of refusals that are about one file; the others are fetched nevertheless."""


@dataclass(frozen=True)
class Fetched:
    """A downloaded file."""

    path: Path
    etag: str
    """The entity tag of the artifact on the service."""
    size: int


@dataclass(frozen=True)
class FetchResult:
    """The result of fetching a job."""

    folder: Path
    files: tuple[Path, ...]
    """All files of the job that are in the folder now."""
    fetched: int
    """The number of files that this call downloaded."""
    fetched_bytes: int
    missing: Missing
    """What could not be brought; false if there is nothing."""


def fetch_job(
    client: Client, job_id: str, folder: Path, *, frames: str | None = None, masters: bool = False
) -> FetchResult:
    """Download the finished files of a job into a folder: PNG pictures or EXR masters, and all outputs.

    A file that is damaged on the service, or that is not made yet, prevents no other.

    Raises
    ------
    BadInput
        If the folder cannot be written.
    """
    numbers = set(parse_frames(frames)) if frames else None
    kinds = (*PICTURES, *MASTERS_ONLY) if masters else PICTURES
    state = read_state(client, job_id)  # before the list of files: what is made in between is not damaged
    wanted = tuple(_wanted(client, job_id, numbers, kinds))
    downloaded: list[Fetched] = []
    damaged: dict[str, str] = {}
    with _record_of(folder) as record, ProgressLine(f"fetch {job_id}") as line:
        for number, artifact in enumerate(wanted):
            path = _place(artifact.name, masters=masters)
            if not _is_complete(folder, record.known.get(path.as_posix()), artifact):
                try:
                    fetched = _download(client, job_id, artifact, folder, path)
                except Refused as error:
                    if error.code not in _DAMAGED:
                        raise
                    damaged[artifact.name] = error.message
                else:
                    downloaded.append(fetched)
                    record.add(path.as_posix(), fetched)
            total = size_text(sum(one.size for one in downloaded))
            count = number + 1
            line.show(count / len(wanted), f"{count} of {len(wanted)} files, {total}", news=count == len(wanted))
    whole = [artifact.name for artifact in wanted if artifact.name not in damaged]
    missing = find_missing(state, set(whole), damaged, frames=numbers, kinds=kinds)
    write_missing(folder, missing)
    return FetchResult(
        folder,
        tuple(folder / _place(name, masters=masters) for name in whole),
        fetched=len(downloaded),
        fetched_bytes=sum(one.size for one in downloaded),
        missing=missing,
    )


def _wanted(client: Client, job_id: str, numbers: set[int] | None, kinds: Sequence[str]) -> Iterator[Artifact]:
    for kind in kinds:
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
    as_picture = path.suffix == ".exr" and path.parts[0] in PICTURES and not masters
    return path.with_suffix(".png") if as_picture else path


def _is_complete(folder: Path, known: Fetched | None, artifact: Artifact) -> bool:
    if known is None or known.etag != artifact.etag:
        return False
    try:
        return (folder / known.path).stat().st_size == known.size
    except OSError:
        return False


def _download(client: Client, job_id: str, artifact: Artifact, folder: Path, path: Path) -> Fetched:
    made: Literal["png"] | None = "png" if path.suffix != Path(artifact.name).suffix else None
    try:
        download = client.download(job_id, artifact.name, folder / path, format=made)
    except OSError as error:
        raise BadInput(f"expected a folder to write {folder / path}, got: {error.strerror}") from error
    return Fetched(path=path, etag=artifact.etag, size=download.size)


@dataclass
class _Record:
    """The downloaded files by their path in the folder; written every `SAVED_EVERY_S`, because it may be long."""

    folder: Path
    known: dict[str, Fetched]
    _saved_s: float
    _is_saved: bool = True

    def add(self, place: str, fetched: Fetched) -> None:
        """Record a downloaded file."""
        self.known[place], self._is_saved = fetched, False
        if time.monotonic() - self._saved_s > SAVED_EVERY_S:
            self.save()

    def save(self) -> None:
        """Write the record to disk if it has changed."""
        if not self._is_saved:
            _write_record(self.folder, self.known)
            self._saved_s, self._is_saved = time.monotonic(), True


@contextmanager
def _record_of(folder: Path) -> Iterator[_Record]:
    """Yield the record of a folder; it is written however the fetch ends."""
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
        return {}  # A lost record costs downloads and nothing else.


def _write_record(folder: Path, record: Mapping[str, Fetched]) -> None:
    beside = folder / f"{RECORD}.part"
    data = {name: {key: value for key, value in asdict(one).items() if key != "path"} for name, one in record.items()}
    beside.write_text(json.dumps(data, indent=1, sort_keys=True))
    beside.replace(folder / RECORD)


def fetch_text(result: FetchResult, *, most: int = 8) -> str:
    """Return the files that are in the folder now, as text, one line for each sub-folder."""
    folders: dict[Path, list[Path]] = {}
    for path in result.files:
        folders.setdefault(path.parent, []).append(path)
    lines = [_folder_line(folder, paths) for folder, paths in folders.items()]
    new = f"{result.fetched} of them new ({size_text(result.fetched_bytes)})"
    head = f"{len(result.files)} files in {result.folder}, {new}"
    return "\n".join([head, *lines[:most]])


def _folder_line(folder: Path, paths: Sequence[Path]) -> str:
    names = [path.name for path in paths]
    return f"  {folder}/  " + (" ".join(names) if len(names) <= 3 else f"{names[0]} ... {names[-1]} ({len(names)})")
