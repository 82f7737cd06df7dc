"""Errors become problem details (RFC 9457), by one handler and one table. A browser gets them as a page."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from http import HTTPStatus
from typing import Any

import structlog
from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse, Response
from sqlalchemy.exc import DataError, InterfaceError, OperationalError
from sqlalchemy.exc import TimeoutError as PoolTimeout
from starlette.exceptions import HTTPException
from starlette.routing import Match
from starlette.types import Scope

from lippmann.errors import FieldProblem, LippmannError, StoreFull, first_problems
from lippmann.job.fields.problem_words import expected_words, got_words
from lippmann.logs import trace_of
from service.errors import (
    ArtifactRepairing,
    DatabaseUnavailable,
    Invalid,
    PreviewUnavailable,
    RangeNotSatisfiable,
    ServiceError,
    TooManyRequests,
    problems_in,
    status_of,
)
from service.schemas.problem import FieldError, Problem

MEDIA_TYPE = "application/problem+json"
REPAIR_S = "10"
"""The seconds after which a client may ask again for an artifact that is made again."""
NOTHING_HERE = "there is nothing at this address"
_REFUSED = re.compile(r"\s*q\s*=\s*0(?:\.0*)?\s*")
_METHODS = ("GET", "HEAD", "POST", "PUT", "PATCH", "DELETE")
_CODE_OF_STATUS = {404: "not-found", 405: "method-not-allowed", 400: "bad-request", 413: "too-large"}

LOG_IDS = "log_ids"
"""The name under which the state of a request holds the ids that every line about it carries."""

log = structlog.get_logger("service.problems")

ProblemPage = Callable[[Problem], Response]
"""Makes the page that shows a problem to the user of a browser."""


def install(app: FastAPI, *, page: ProblemPage) -> None:
    """Install the handler of all errors of an application, and the page that shows them in a browser."""
    app.state.problem_page = page
    ours = (ServiceError, LippmannError)
    theirs = (RequestValidationError, HTTPException, DataError, OperationalError, InterfaceError, PoolTimeout)
    for kind in (*ours, *theirs):
        app.add_exception_handler(kind, answer)
    app.add_exception_handler(Exception, answer_unexpected)


async def answer_unexpected(request: Request, error: Exception) -> Response:
    """Answer a request that failed for an unknown reason; no middleware adds headers to this answer."""
    ids = request.scope.get("state", {}).get(LOG_IDS, {})
    with structlog.contextvars.bound_contextvars(**ids):
        response = await answer(request, error)
    response.headers["X-Request-Id"] = ids.get("request_id", "")
    response.headers["X-Content-Type-Options"] = "nosniff"
    return response


async def answer(request: Request, error: Exception) -> Response:
    """Answer a request that failed."""
    if isinstance(error, HTTPException) and isinstance(error.__cause__, ServiceError | LippmannError):
        error = error.__cause__  # raised while FastAPI read the body
    if isinstance(error, HTTPException):
        code = _CODE_OF_STATUS.get(error.status_code, "bad-request")
        detail, headers = NOTHING_HERE if code == "not-found" else str(error.detail), error.headers
        if code == "method-not-allowed":
            allowed = _methods(request)
            detail, headers = f"expected {' or '.join(allowed)}, got {request.method}", {"Allow": ", ".join(allowed)}
        return problem_response(request, error.status_code, code, detail, headers=headers)
    known = translate(error)
    status = status_of(known.code)
    if status >= 500 and not isinstance(known, ArtifactRepairing | PreviewUnavailable):
        # While the database is away, every request fails; a trace of each would only hide the cause.
        trace = None if isinstance(known, DatabaseUnavailable) else trace_of(error)
        log.error("a request failed", path=request.url.path, code=known.code, error=repr(error), trace=trace)
    headers = {"WWW-Authenticate": "Bearer"} if status == 401 else {}
    if status == 503:
        headers["Retry-After"] = REPAIR_S
    if isinstance(known, TooManyRequests):
        headers["Retry-After"] = str(max(1, math.ceil(known.retry_after_s)))
    if isinstance(known, RangeNotSatisfiable):
        headers["Content-Range"] = f"bytes */{known.size}"
    return problem_response(request, status, known.code, known.message, problems_in(known), headers=headers)


def translate(error: Exception) -> ServiceError | LippmannError:
    """Translate any error to an error of this project."""
    if isinstance(error, ServiceError | LippmannError):
        return error
    if isinstance(error, RequestValidationError):
        problems = first_problems(_field_problem(item) for item in error.errors())
        return Invalid("; ".join(map(str, problems)), problems=problems)
    if isinstance(error, OperationalError) and "full" in str(error.orig):
        return StoreFull("the database has no space left")
    if isinstance(error, DataError):
        return Invalid("a text contains a character that the database cannot store, such as NUL")
    if isinstance(error, OperationalError | InterfaceError | PoolTimeout):
        return DatabaseUnavailable()
    return ServiceError()


def problem_response(
    request: Request,
    status: int,
    code: str,
    detail: str,
    problems: tuple[FieldProblem, ...] = (),
    *,
    headers: Mapping[str, str] | None = None,
) -> Response:
    """Return problem details as a response: a page for a browser that opens an address, and JSON for all others."""
    problem = Problem(
        type=f"urn:lippmann:problem:{code}",
        title=HTTPStatus(status).phrase,
        status=status,
        detail=detail,
        code=code,
        instance=request.url.path,
        request_id=request.scope.get("state", {}).get("request_id", ""),
        errors=tuple(FieldError(field=item.field, expected=item.expected, got=item.got) for item in problems),
    )
    if wants_page(request):
        response: Response = request.app.state.problem_page(problem)
    else:
        response = JSONResponse(problem.model_dump(), status_code=status, media_type=MEDIA_TYPE)
    response.headers.update({"Vary": "Accept", **(headers or {})})
    return response


def wants_page(request: Request) -> bool:
    """Return whether a request asks for a page, as browsers do for the address of a window and for a form."""
    kinds = [part.split(";") for part in request.headers.get("accept", "").lower().split(",")]
    return any(kind.strip() == "text/html" and not any(map(_REFUSED.fullmatch, more)) for kind, *more in kinds)


def head_is_get(scope: Scope) -> bool:
    """Return whether HEAD is answered as GET: not at the login, whose links serve once."""
    return not scope["path"].removeprefix(scope.get("root_path", "")).startswith("/login")


def _methods(request: Request) -> list[str]:
    """Return the methods of an address. What has GET has HEAD: see `middleware.HeadAsGet`."""
    asked = {method: {**request.scope, "method": method} for method in _METHODS}
    if head_is_get(request.scope):
        asked["HEAD"] = asked["GET"]
    routes = request.app.routes
    return [name for name, scope in asked.items() if any(one.matches(scope)[0] is Match.FULL for one in routes)]


def _field_problem(item: Any) -> FieldProblem:
    where = [str(part) for part in item["loc"]]
    field = ".".join(where[1:] or where)
    if item["type"] == "missing":
        return FieldProblem(field=field, expected="a value", got="nothing")
    got = got_words(item.get("input"))
    if item["type"] == "extra_forbidden":
        return FieldProblem(field=field, expected="no field of this name", got=got)
    return FieldProblem(field=field, expected=expected_words(item), got=got)
