"""Errors, as problem details of RFC 9457."""

from __future__ import annotations

from service.schemas.answer import Answer


class FieldError(Answer):
    """One field at fault: its path, what was expected, and what was sent."""

    field: str
    expected: str
    got: str


class Problem(Answer):
    """An error."""

    type: str
    """The type as `urn:lippmann:problem:<code>`."""
    title: str
    """The phrase of the HTTP status."""
    status: int
    detail: str
    """The message for the user."""
    code: str
    """The code of the error, such as `not-found`."""
    instance: str
    """The path of the request."""
    request_id: str
    """The id of the request, which is also in the header `X-Request-Id` and in the log."""
    errors: tuple[FieldError, ...] = ()
    """The fields at fault."""
