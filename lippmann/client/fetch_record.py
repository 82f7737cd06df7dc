"""The record of a folder of downloaded files: which job they belong to, and the entity tag and size of each.

    .fetched.json   {"job": "01k...", "demo": false, "files": {"integral/0001.png": {"etag": "...", "size": 1234}}}

A folder belongs to one job. The next demo takes over the folder of a demo, whose files are deleted.
"""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from pathlib import Path

from lippmann.errors import BadInput

RECORD = ".fetched.json"
SAVED_EVERY_S = 5.0
"""The interval at which the record is written while files are downloaded, s."""
PICTURES = ("integral", "orthoscopic", "device", "views")
MASTERS_ONLY = ("depth",)
"""These hold numbers, so no PNG picture is made of them."""
OUTPUTS = ("video", "exports")


@dataclass(frozen=True)
class Fetched:
    """A downloaded file."""

    path: Path
    etag: str
    """The entity tag of the artifact on the service."""
    size: int


@dataclass
class FetchRecord:
    """The downloaded files by their path in the folder; written every `SAVED_EVERY_S`, because it may be long.

    Several threads may add files.
    """

    folder: Path
    job_id: str | None
    """The job; None in a record of an earlier release, which does not name it, and in one that cannot be read."""
    is_demo: bool
    known: dict[str, Fetched]
    _saved_s: float = field(default_factory=time.monotonic)
    _is_saved: bool = True
    _lock: threading.Lock = field(default_factory=threading.Lock)

    def add(self, place: str, fetched: Fetched) -> None:
        """Record a downloaded file."""
        with self._lock:
            self.known[place], self._is_saved = fetched, False
            if time.monotonic() - self._saved_s > SAVED_EVERY_S:
                self._write()

    def save(self) -> None:
        """Write the record to disk if it has changed."""
        with self._lock:
            if not self._is_saved:
                self._write()

    def _write(self) -> None:
        write_record(self)
        self._saved_s, self._is_saved = time.monotonic(), True


@contextmanager
def record_of(folder: Path, job_id: str, *, etags: Mapping[str, str], is_demo: bool = False) -> Iterator[FetchRecord]:
    """Provide the record of a folder for a job; it is written however the fetch ends.

    Parameters
    ----------
    etags
        The entity tags of the files of the job by their path in the folder. They identify the job of a folder whose
        record does not name it.
    is_demo
        True to take over the folder of an earlier demo, whose files are deleted.

    Raises
    ------
    BadInput
        If the folder holds the files of another job, or cannot be written.
    """
    found = check_folder(folder, job_id=job_id, is_demo=is_demo)
    known = {} if found is None else found.known
    if found is not None and found.job_id is None and known:
        if not any(etags.get(place) == one.etag for place, one in known.items()):
            raise _taken(folder, "the files of another job", job_id)
    elif found is not None and found.job_id != job_id:
        _delete_files(found)
        known = {}
    record = FetchRecord(folder, job_id, is_demo, known)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        write_record(record)
    except OSError as error:
        raise BadInput(f"expected a folder to write, got {folder}: {error.strerror}") from error
    try:
        yield record
    finally:
        record.save()


def check_folder(folder: Path, *, job_id: str | None, is_demo: bool = False) -> FetchRecord | None:
    """Return the record of a folder; None for a folder without a record.

    Parameters
    ----------
    job_id
        The job whose files come into the folder; None if there is no job yet.
    is_demo
        True if the files of an earlier demo may be replaced.

    Raises
    ------
    BadInput
        If the folder holds the files of another job, or files that no job has brought.
    """
    found = _read_record(folder)
    if found is None:
        ours = [name for name in (*PICTURES, *MASTERS_ONLY, *OUTPUTS) if (folder / name).exists()]
        if ours:
            raise _taken(folder, f"{ours[0]}/, which no fetch has brought", job_id)
    elif found.job_id not in (None, job_id) and not (is_demo and found.is_demo):
        raise _taken(folder, f"the files of job {found.job_id}", job_id)
    return found


def _taken(folder: Path, holds: str, job_id: str | None) -> BadInput:
    own = "" if job_id is None else f" or the one of job {job_id}"
    return BadInput(f"--out: expected a new folder{own}, got {folder} with {holds}")


def _delete_files(record: FetchRecord) -> None:
    for place in record.known:
        path = record.folder / place
        if ".." not in path.parts and not Path(place).is_absolute() and path.is_file():
            path.unlink()
            _remove_empty(path.parent, record.folder)


def _remove_empty(folder: Path, top: Path) -> None:
    while folder != top and not any(folder.iterdir()):
        folder.rmdir()
        folder = folder.parent


def _read_record(folder: Path) -> FetchRecord | None:
    nameless = FetchRecord(folder, None, is_demo=False, known={})
    try:
        data = json.loads((folder / RECORD).read_bytes())
    except (FileNotFoundError, NotADirectoryError):
        return None
    except (OSError, ValueError):
        return nameless  # A damaged record costs downloads and nothing else.
    try:
        named = isinstance(data.get("files"), dict)  # The record of an earlier release has the files alone.
        files = data["files"] if named else data
        known = {name: Fetched(Path(name), one["etag"], one["size"]) for name, one in files.items()}
        return FetchRecord(folder, data.get("job") if named else None, bool(named and data.get("demo")), known)
    except (KeyError, TypeError, AttributeError):
        return nameless


def write_record(record: FetchRecord) -> None:
    """Write a record atomically."""
    beside = record.folder / f"{RECORD}.part"
    files = {
        name: {key: value for key, value in asdict(one).items() if key != "path"} for name, one in record.known.items()
    }
    data = {"job": record.job_id, "demo": record.is_demo, "files": files}
    beside.write_text(json.dumps(data, indent=1, sort_keys=True))
    beside.replace(record.folder / RECORD)
