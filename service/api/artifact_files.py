"""The files of a job: pages of them, media types, ranges, and the logs of attempts."""

from __future__ import annotations

import mimetypes
import re
from base64 import b64encode
from dataclasses import dataclass

from sqlalchemy.orm import Session

from lippmann.digest import Digest
from lippmann.plan import artifact_names as names
from lippmann.plan.artifact_store import ArtifactInfo, ArtifactStore
from service.api.listings import find_task
from service.errors import NotFound, RangeNotSatisfiable
from service.schemas import artifact as schema
from service.schemas.answer import utc
from service.schemas.links import artifact_url

_TYPES = {
    ".exr": "image/x-exr",
    ".pov": "text/plain; charset=utf-8",
    ".txt": "text/plain; charset=utf-8",
    ".mkv": "video/x-matroska",
    ".webp": "image/webp",
    ".json": "application/json",
}
_INLINE = ("image/png", "image/webp", "image/jpeg", "video/", "text/plain", "application/json")
MAX_NAME = 200
_PART = re.compile(r"[A-Za-z0-9_-][A-Za-z0-9._-]*")
_RANGE = re.compile(r"bytes=(\d{0,18})-(\d{0,18})", re.ASCII)


@dataclass(frozen=True)
class File:
    """One file of a job."""

    full_name: str
    """The name in the store."""
    name: str
    size: int
    etag: str
    """The entity tag with its quotes."""
    digest: Digest | None = None
    """The digest of the content; None if it is unknown."""


def page_artifacts(
    store: ArtifactStore, job_id: str, *, prefix: str, cursor: str | None, limit: int
) -> schema.ArtifactPage:
    """Return a page of the files of a job, sorted by name."""
    below = names.job_artifact(job_id, _clean(prefix) if prefix else "")
    found = store.list(below, after=names.job_artifact(job_id, cursor) if cursor else "", limit=limit + 1)
    items = tuple(
        schema.Artifact(
            name=(name := info.name.removeprefix(f"{job_id}/")),
            size=info.size,
            modified_at=utc(info.modified_s),
            etag=info.etag,
            url=artifact_url(job_id, name),
            media_type=media_type(name),
        )
        for info in found[:limit]
    )
    return schema.ArtifactPage(items=items, next_cursor=items[-1].name if len(found) > limit else None)


def file_of(info: ArtifactInfo, name: str, digest: Digest | None) -> File:
    """Return a file of a job by its artifact."""
    return File(full_name=info.name, name=name, size=info.size, etag=f'"{info.etag}"', digest=digest)


def find_log(session: Session, store: ArtifactStore, job_id: str, task_id: str, *, attempt: int | None) -> str:
    """Return the full name of the log of an attempt, by default of the latest attempt that has a log.

    Raises
    ------
    NotFound
        If there is no such log.
    """
    row = find_task(session, job_id, task_id)
    numbers = [attempt] if attempt is not None else range(row.attempt_number, 0, -1)
    for number in numbers:
        name = names.job_artifact(job_id, names.log_name(row.kind, row.frame, row.tile, row.output, number))
        if store.exists(name):
            return name
    raise NotFound(f"task {task_id!r} has no log yet" if attempt is None else f"attempt {attempt} has no log")


def media_type(name: str) -> str:
    """Return the media type of a file by its name.

    >>> media_type("video/views.mp4")
    'video/mp4'
    """
    suffix = name[name.rfind(".") :] if "." in name else ""
    return _TYPES.get(suffix) or mimetypes.guess_type(name)[0] or "application/octet-stream"


def disposition(job_id: str, name: str) -> str:
    """Return the Content-Disposition of a file: whether a browser displays or saves it, and under which name.

    >>> disposition("01h", "integral/0001.exr")
    'attachment; filename="01h-integral-0001.exr"'
    """
    how = "inline" if media_type(name).startswith(_INLINE) else "attachment"
    flat = re.sub(r"[^A-Za-z0-9._-]", "-", f"{job_id}-{name}")
    return f'{how}; filename="{flat}"'


def digest_field(digest: Digest) -> str:
    """Return the value of the header Repr-Digest (RFC 9530).

    >>> digest_field(Digest(0, "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855"))
    'sha-256=:47DEQpj8HBSa+/TImW+5JCeuQeRkm5NMpJWZG3hSuFU=:'
    """
    return f"sha-256=:{b64encode(bytes.fromhex(digest.sha256)).decode()}:"


def prefers(header: str | None, preference: str) -> bool:
    """Return whether a Prefer header (RFC 7240) has a preference.

    >>> prefers("respond-async, Redirect; a=1", "redirect"), prefers(None, "redirect")
    (True, False)
    """
    return any(part.partition(";")[0].strip().lower() == preference for part in (header or "").split(","))


def is_fresh(if_none_match: str | None, etag: str) -> bool:
    """Return whether the caller already has the file, by If-None-Match.

    >>> is_fresh('W/"a", "b"', '"b"')
    True
    """
    if if_none_match is None:
        return False
    known = {tag.strip().removeprefix("W/") for tag in if_none_match.split(",")}
    return "*" in known or etag in known


def parse_range(header: str | None, size: int) -> tuple[int, int] | None:
    """Return the bytes [start, stop) that a Range header requests; None for the whole file.

    A header that is not a single range of bytes is ignored, as RFC 9110 allows.

    Raises
    ------
    RangeNotSatisfiable
        If the range lies outside the file.

    Examples
    --------
    >>> parse_range("bytes=-3", 10)
    (7, 10)
    """
    match = _RANGE.fullmatch((header or "").strip())
    if match is None or not any(match.groups()):
        return None
    first, last = match.groups()
    start = int(first) if first else max(0, size - int(last))
    stop = min(int(last) + 1, size) if first and last else size
    if first and last and int(last) < int(first):
        return None
    if start >= size or stop <= start:
        raise RangeNotSatisfiable(size)
    return start, stop


def full_name(job_id: str, name: str) -> str:
    """Return the name in the store of a file of a job; NotFound for a name that no file may have."""
    if name.endswith("/"):
        raise NotFound(f"there is no artifact {name[:MAX_NAME]!r}")
    return names.job_artifact(job_id, _clean(name))


def _clean(name: str) -> str:
    # The store raises ValueError for invalid names, but here they come from the client: such a file does not exist.
    if len(name) > MAX_NAME or not all(_PART.fullmatch(part) for part in name.removesuffix("/").split("/")):
        raise NotFound(f"there is no artifact {name[:MAX_NAME]!r}")
    return name
