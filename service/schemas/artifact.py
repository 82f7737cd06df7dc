"""A file of a job."""

from __future__ import annotations

from datetime import datetime

from service.schemas.answer import Answer


class Artifact(Answer):
    """A file of a job."""

    name: str
    """The name within the job, such as `integral/0001.exr`."""
    size: int
    """The size in bytes."""
    modified_at: datetime
    etag: str
    """The entity tag without quotes. It changes with the content."""
    url: str
    media_type: str


class ArtifactPage(Answer):
    """A page of files, sorted by name."""

    items: tuple[Artifact, ...]
    next_cursor: str | None
    """The cursor of the next page; null on the last page."""
