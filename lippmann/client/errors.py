"""What the service refuses."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from lippmann.errors import BadInput, FieldProblem, LippmannError, NotAllowed


class Refused(LippmannError):
    """The service refused."""

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
        """The last part of the problem's type: `not-found`, `move-not-allowed`, `spec`, ..."""
        self.problems = problems
        """The fields that are wrong: where, what was expected, what came."""
        self.request_id = request_id


class RequestInvalid(Refused, BadInput):
    """The request is invalid."""


class KeyRefused(Refused, NotAllowed):
    """The key is not known, or its role is too low."""


_KINDS: Mapping[int, type[Refused]] = {
    400: RequestInvalid,
    401: KeyRefused,
    403: KeyRefused,
    413: RequestInvalid,
    422: RequestInvalid,
}


def refusal(status: int, reason: str, problem: Any) -> Refused:
    """Return the error for an answer that is none: RFC 9457 problem details where the service gave them."""
    said: Mapping[str, Any] = problem if isinstance(problem, Mapping) else {}
    problems = tuple(
        FieldProblem(field=str(item.get("field")), expected=str(item.get("expected")), got=str(item.get("got")))
        for item in said.get("errors") or ()
    )
    message = str(said.get("detail") or said.get("title") or f"the service answered {status} {reason}")
    if problems:
        message = "; ".join(map(str, problems))
    kind = _KINDS.get(status, Refused)
    return kind(
        message,
        status=status,
        code=str(said.get("code", "")),
        problems=problems,
        request_id=str(said.get("request_id", "")),
    )
