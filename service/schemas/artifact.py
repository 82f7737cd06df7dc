"""A file of a job."""

from __future__ import annotations

from datetime import datetime

from pydantic import Field

from service.schemas.answer import Answer, RequestBody


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


class LinkRequest(RequestBody):
    """A request for a link to a file of a job."""

    artifact: str = Field(min_length=1, max_length=200)
    """The name of the file within the job, such as `integral/0001.exr`."""
    expires_in_s: float | None = Field(default=None, ge=1)
    """The time until the link expires, at most what the farm allows; null for a day, or less if the farm allows
    less."""


class ArtifactLink(Answer):
    """A link that downloads one file of a job without a key."""

    artifact: str
    url: str
    """The whole URL. Whoever has it can download the file until the link expires."""
    expires_at: datetime
