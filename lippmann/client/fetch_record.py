"""The record of a folder of downloaded files: which job they belong to, and how to recognise each.

    .fetched.json   {"job": "01k...", "demo": false,
                     "files": {"integral/0001.png": {"etag": "...", "size": 1234, "mtime_ns": 1780000000000000000}}}

A folder belongs to one job, and one fetch at a time writes to it. The next demo takes over the folder of a demo, whose
files are deleted. A folder with a file that has changed since it was downloaded is refused to that demo, because the
file may be the user's.
"""

from __future__ import annotations

import fcntl
import json
import os
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from pathlib import Path

from lippmann.errors import BadInput

RECORD = ".fetched.json"
LOCK = ".fetched.lock"
SAVED_EVERY_S = 5.0
"""The interval at which the record is written while files are downloaded, s."""
PICTURES = ("integral", "orthoscopic", "device", "views")
MASTERS_ONLY = ("depth", "channels")
"""These hold numbers, so no PNG picture is made of them."""
OUTPUTS = ("video", "exports")


@dataclass(frozen=True)
class Fetched:
    """A downloaded file."""

    path: Path
    etag: str
    """The entity tag of the artifact on the service."""
    size: int
    mtime_ns: int | None
    """When the file was last modified, ns since 1970; None in a record that does not say so."""

    def is_still_in(self, folder: Path) -> bool:
        """Return whether the file is in the folder as it was downloaded."""
        try:
            found = (folder / self.path).stat()
        except OSError:
            return False
        return found.st_size == self.size and self.mtime_ns in (None, found.st_mtime_ns)


@dataclass
class FetchRecord:
    """The downloaded files by their path in the folder; written every `SAVED_EVERY_S`, because it may be long.

    Several threads may add files.
    """

    folder: Path
    job_id: str | None
    """The job; None in a record of an earlier release, which does not name it."""
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
def record_of(
    folder: Path, job_id: str, *, etags: Callable[[], Mapping[str, str]], is_demo: bool = False
) -> Iterator[FetchRecord]:
    """Provide the record of a folder for a job; it is written however the fetch ends.

    Parameters
    ----------
    etags
        Returns the entity tags of all files of the job by their path in the folder. It is called only for a folder
        whose record does not name its job; they identify it.
    is_demo
        True to take over the folder of an earlier demo, whose files are deleted.

    Raises
    ------
    BadInput
        If the folder holds the files of another job, cannot be written, or another fetch writes to it.
    """
    with _alone_in(folder):
        record = _opened(folder, job_id, etags=etags, is_demo=is_demo)
        try:
            yield record
        finally:
            record.save()


def _opened(folder: Path, job_id: str, *, etags: Callable[[], Mapping[str, str]], is_demo: bool) -> FetchRecord:
    found = check_folder(folder, job_id=job_id, is_demo=is_demo)
    known = {} if found is None else found.known
    if found is not None and found.job_id is None and known:
        of_job = etags()
        if not any(of_job.get(place) == one.etag for place, one in known.items()):
            raise _taken(folder, "the files of another job", job_id)
    elif found is not None and found.job_id != job_id:
        _delete_files(found)
        known = {}
    elif found is not None:
        is_demo = is_demo or found.is_demo  # A further fetch of a demo leaves its folder to the next demo.
    record = FetchRecord(folder, job_id, is_demo, known)
    try:
        write_record(record)
    except OSError as error:
        raise _not_writable(folder, error) from error
    return record


@contextmanager
def _alone_in(folder: Path) -> Iterator[None]:
    """Keep other fetches out of a folder, because two would write the same temporary files; make a missing one.

    The lock ends with the process. Its file is removed at the end, so a fetch that has opened it just before looks
    whether it still is the file of the folder. A file system without locks keeps nobody out.
    """
    while True:
        try:
            folder.mkdir(parents=True, exist_ok=True)
            descriptor = os.open(folder / LOCK, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
        except OSError as error:
            raise _not_writable(folder, error) from error
        try:
            _lock(descriptor, folder)
            if not _is_at(folder / LOCK, descriptor):
                continue
            try:
                yield
            finally:
                (folder / LOCK).unlink(missing_ok=True)
            return
        finally:
            os.close(descriptor)


def _lock(descriptor: int, folder: Path) -> None:
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise BadInput(
            f"--out: expected a folder that no other fetch uses, got {folder}, to which one writes"
        ) from None
    except OSError:
        return  # This file system has no locks.


def _is_at(path: Path, descriptor: int) -> bool:
    try:
        return os.path.samestat(path.stat(), os.fstat(descriptor))
    except FileNotFoundError:
        return False


def _not_writable(folder: Path, error: OSError) -> BadInput:
    return BadInput(f"expected a folder to write, got {folder}: {error.strerror}")


def check_folder(folder: Path, *, job_id: str | None, is_demo: bool = False) -> FetchRecord | None:
    """Return the record of a folder; None for a folder without a record that can be read.

    Parameters
    ----------
    job_id
        The job whose files come into the folder; None if there is no job yet.
    is_demo
        True if the files of an earlier demo may be replaced. They may not if one has changed since it was fetched.

    Raises
    ------
    BadInput
        If the folder holds the files of another job, or files of which no record says that a fetch has brought them;
        without it, those of two jobs would be mixed. A demo is a new job, so the files of a job that the record does
        not name are those of another one.
    """
    found = _read_record(folder)
    if found is None:
        ours = [name for name in (*PICTURES, *MASTERS_ONLY, *OUTPUTS) if (folder / name).exists()]
        if ours:
            why = (
                f"whose record {RECORD} cannot be read" if (folder / RECORD).exists() else "which no fetch has brought"
            )
            raise _taken(folder, f"{ours[0]}/, {why}", job_id)
    elif found.job_id is None:
        if is_demo and found.known:
            raise _taken(folder, "the files of a job that an earlier release has fetched", job_id)
    elif found.job_id != job_id:
        if not (is_demo and found.is_demo):
            raise _taken(folder, f"the files of job {found.job_id}", job_id)
        for place, one in _places_inside(found):
            if (folder / place).exists() and not one.is_still_in(folder):
                raise _taken(folder, f"{place}, which has changed since it was fetched", job_id)
    return found


def _taken(folder: Path, holds: str, job_id: str | None) -> BadInput:
    own = "" if job_id is None else f" or the one of job {job_id}"
    return BadInput(f"--out: expected a new folder{own}, got {folder} with {holds}")


def _delete_files(record: FetchRecord) -> None:
    for place, one in _places_inside(record):
        path = record.folder / place
        if path.is_file() and one.is_still_in(record.folder):
            path.unlink()
            _remove_empty(path.parent, record.folder)


def _places_inside(record: FetchRecord) -> Iterator[tuple[str, Fetched]]:
    for place, one in record.known.items():
        if ".." not in Path(place).parts and not Path(place).is_absolute():
            yield place, one


def _remove_empty(folder: Path, top: Path) -> None:
    while folder != top and not any(folder.iterdir()):
        folder.rmdir()
        folder = folder.parent


def _read_record(folder: Path) -> FetchRecord | None:
    try:
        data = json.loads((folder / RECORD).read_bytes())
    except (OSError, ValueError):
        return None
    try:
        named = isinstance(data.get("files"), dict)  # The record of an earlier release has the files alone.
        files = data["files"] if named else data
        known = {
            name: Fetched(Path(name), one["etag"], one["size"], one.get("mtime_ns")) for name, one in files.items()
        }
        record = FetchRecord(folder, data.get("job") if named else None, bool(named and data.get("demo")), known)
    except (KeyError, TypeError, AttributeError):
        return None
    return None if record.job_id is None and not known else record  # It names nothing.


def write_record(record: FetchRecord) -> None:
    """Write a record atomically, also if the power fails."""
    beside = record.folder / f"{RECORD}.part"
    files = {
        name: {key: value for key, value in asdict(one).items() if key != "path"} for name, one in record.known.items()
    }
    data = {"job": record.job_id, "demo": record.is_demo, "files": files}
    with beside.open("w") as file:
        file.write(json.dumps(data, indent=1, sort_keys=True))
        file.flush()
        os.fsync(file.fileno())  # Else a power failure may leave an empty record, and the folder is refused.
    beside.replace(record.folder / RECORD)
