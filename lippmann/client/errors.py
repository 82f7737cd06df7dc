"""Refusals of the service."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.metadata import version
from typing import Any

from lippmann.errors import BadInput, FieldProblem, LippmannError, NotAllowed, Unreachable


class Refused(LippmannError):
    """The service refused the request."""

    def __init__(
        self,
        message: str,
        *,
        status: int,
        code: str = "",
        problems: tuple[FieldProblem, ...] = (),
        request_id: str = "",
    ) -> None:
        super().__init__(message)
        self.status = status
        self.code = code
        """The last part of the type of the problem, such as `not-found` or `spec`."""
        self.problems = problems
        """The invalid fields: their paths, what was expected and what was given."""
        self.request_id = request_id


class RequestInvalid(Refused, BadInput):
    """The request is invalid."""


class KeyRefused(Refused, NotAllowed):
    """The key is not known, or its role does not permit the operation."""


class NotLippmann(Unreachable):
    """The URL is not that of a Lippmann service, or that service has another version."""

    @classmethod
    def at(cls, url: object, got: str) -> NotLippmann:
        """Return the error of an answer of a URL."""
        return cls(f"expected an answer of a Lippmann service of version {version('lippmann')} at {url}, got {got}")


_KINDS: Mapping[int, type[Refused]] = {
    400: RequestInvalid,
    401: KeyRefused,
    403: KeyRefused,
    413: RequestInvalid,
    422: RequestInvalid,
}


def _without_details(status: int, reason: str) -> str:
    return f"expected an answer of a Lippmann service, got {status} {reason}"


def refusal(status: int, reason: str, problem: Any) -> Refused:
    """Return the exception for an error response, from its RFC 9457 problem details if there are any."""
    details: Mapping[str, Any] = problem if isinstance(problem, Mapping) else {}
    problems = tuple(
        FieldProblem(field=str(item.get("field")), expected=str(item.get("expected")), got=str(item.get("got")))
        for item in details.get("errors") or ()
    )
    message = str(details.get("detail") or details.get("title") or _without_details(status, reason))
    if problems:
        message = "; ".join(map(str, problems))
    kind = _KINDS.get(status, Refused)
    return kind(
        message,
        status=status,
        code=str(details.get("code", "")),
        problems=problems,
        request_id=str(details.get("request_id", "")),
    )
