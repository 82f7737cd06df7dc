"""A file of a job."""

from __future__ import annotations

from datetime import datetime

from service.schemas.answer import Answer


class Artifact(Answer):
    """A file."""

    name: str
    """Below the job: `integral/0001.exr`."""
    size: int
    modified_at: datetime
    etag: str
    url: str
    media_type: str


class ArtifactPage(Answer):
    """Files by name."""

    items: tuple[Artifact, ...]
    next_cursor: str | None
