"""The base of all answers and of all bodies of requests, and times."""

from __future__ import annotations

from datetime import UTC, datetime

from pydantic import BaseModel, ConfigDict

from lippmann.job.fields.json_types import JsonTyped

MAX_LIMIT = 500
"""The largest number of items in a page."""


class Answer(BaseModel):
    """The base class of all answers of the API."""

    model_config = ConfigDict(frozen=True, extra="forbid", use_attribute_docstrings=True)


class RequestBody(Answer, JsonTyped):
    """The base class of what a client sends as JSON."""


def utc(seconds: float) -> datetime:
    """Convert seconds since 1970 to a time.

    >>> utc(0.0).isoformat()
    '1970-01-01T00:00:00+00:00'
    """
    return datetime.fromtimestamp(seconds, UTC)


def utc_or_none(seconds: float | None) -> datetime | None:
    """Convert seconds since 1970 to a time; None stays None."""
    return None if seconds is None else utc(seconds)
