"""Every error: RFC 9457 problem details."""

from __future__ import annotations

from service.schemas.answer import Answer


class FieldError(Answer):
    """One field that is wrong: where, what was expected, what came."""

    field: str
    expected: str
    got: str


class Problem(Answer):
    """What went wrong."""

    type: str
    """`urn:lippmann:problem:<code>`."""
    title: str
    status: int
    detail: str
    code: str
    instance: str
    request_id: str
    errors: tuple[FieldError, ...] = ()
