"""The form of every answer, and times."""

from __future__ import annotations

from datetime import UTC, datetime

from pydantic import BaseModel, ConfigDict

MAX_LIMIT = 500
"""The longest page."""


class Answer(BaseModel):
    """Something that the API says."""

    model_config = ConfigDict(frozen=True, extra="forbid", use_attribute_docstrings=True)


def utc(seconds: float) -> datetime:
    """Return seconds since 1970 as a time.

    >>> utc(0.0).isoformat()
    '1970-01-01T00:00:00+00:00'
    """
    return datetime.fromtimestamp(seconds, UTC)


def utc_or_none(seconds: float | None) -> datetime | None:
    """Return seconds since 1970 as a time, or None."""
    return None if seconds is None else utc(seconds)
