"""The OpenAPI description: which problems and which keys each operation has.

The statuses of an operation follow from its method, its parameters and its dependencies. A route only declares what no
dependency shows, by `problems`.
"""

from __future__ import annotations

from collections.abc import Iterator
from types import MappingProxyType
from typing import Any

from fastapi import FastAPI
from fastapi.dependencies.models import Dependant
from fastapi.routing import RouteContext, iter_route_contexts

from service.dependencies import (
    COOKIE,
    SAFE_METHODS,
    get_own_job,
    identify_caller,
    require_admin,
    require_submitter,
)
from service.routes.metrics import admit_monitor
from service.routes.problems import MEDIA_TYPE
from service.schemas.problem import Problem

Responses = dict[int | str, dict[str, Any]]

NOT_CHANGED: Responses = {304: {"description": "The ETag is that of If-None-Match."}}

_PROBLEMS = MappingProxyType(
    {
        400: ("BadRequest", "The form is malformed."),
        401: ("Unauthorized", "There is no key, or it is unknown, was revoked or has expired."),
        403: (
            "Forbidden",
            "The role or the owner of the key does not allow this, or another site sent the request.",
        ),
        404: ("NotFound", "The item does not exist, or is hidden from the caller."),
        409: ("Conflict", "The action is not allowed in the present status, or the item belongs to the service."),
        413: ("TooLarge", "The request is too large."),
        416: ("RangeNotSatisfiable", "The range lies outside the file; `Content-Range` gives its size."),
        422: ("Invalid", "A field is invalid; `errors` gives the fields."),
        429: ("TooManyRequests", "A rate or a quota is exceeded; `Retry-After` gives the seconds to wait."),
        500: ("Internal", "The service failed; the log has the `request_id`."),
        503: (
            "Unavailable",
            "The database or the store does not answer, a damaged file is made again, or a picture took too long.",
        ),
        507: ("Full", "The database or the store has no space left."),
    }
)
"""The name and the description of each status of a problem."""
_HEADERS = MappingProxyType({401: "WWW-Authenticate", 416: "Content-Range", 429: "Retry-After", 503: "Retry-After"})
"""The header that belongs to a status."""
_ASKS_FOR_KEY = frozenset({identify_caller, admit_monitor})
_EXTRA_KEYS = MappingProxyType({require_submitter: 403, require_admin: 403, get_own_job: 403})


def problems(*statuses: int) -> Responses:
    """Return the responses of a route that has these problems besides those that follow from its dependencies."""
    return {status: {} for status in statuses}


class DescribedApp(FastAPI):
    """An application whose description has the problems and the keys of all operations."""

    def openapi(self) -> dict[str, Any]:
        """Return the OpenAPI description."""
        described = super().openapi()
        if "responses" not in described["components"]:
            _describe(described, self)
        return described


def _describe(described: dict[str, Any], app: FastAPI) -> None:
    for route in iter_route_contexts(app.routes):
        for method in (route.methods or ()) if route.path_format in described["paths"] else ():
            operation = described["paths"][route.path_format].get(method.lower())
            if operation is not None:
                _describe_operation(operation, method, route)
    for methods in described.get("webhooks", {}).values():
        for operation in methods.values():
            operation["responses"].pop("422", None)  # The receiver answers as its description says.
    components = described["components"]
    components["responses"] = {_PROBLEMS[status][0]: _response(status) for status in _PROBLEMS}
    components["securitySchemes"] = {
        "key": {"type": "http", "scheme": "bearer"},
        "session": {"type": "apiKey", "in": "cookie", "name": COOKIE},
    }
    schemas = Problem.model_json_schema(ref_template="#/components/schemas/{model}")
    components["schemas"] |= {**schemas.pop("$defs"), "Problem": schemas}
    for name in ("HTTPValidationError", "ValidationError"):
        components["schemas"].pop(name, None)


def _describe_operation(operation: dict[str, Any], method: str, route: RouteContext) -> None:
    calls = set(_calls(route.dependant))
    if calls & _ASKS_FOR_KEY:
        operation["security"] = [{"key": []}, {"session": []}]
    declared = {int(status) for status in operation["responses"] if int(status) >= 400} - {422}
    for status in sorted(declared | set(_statuses(operation, method, calls))):
        operation["responses"][str(status)] = {"$ref": f"#/components/responses/{_PROBLEMS[status][0]}"}
    if "422" in operation["responses"] and "$ref" not in operation["responses"]["422"]:
        del operation["responses"]["422"]  # of parameters that are not described


def _calls(dependant: Dependant) -> Iterator[Any]:
    yield dependant.call
    for one in dependant.dependencies:
        yield from _calls(one)


def _statuses(operation: dict[str, Any], method: str, calls: set[Any]) -> Iterator[int]:
    """Yield the statuses of problems that follow from what an operation is."""
    parameters = operation.get("parameters", ())
    yield from (429, 500)
    if calls & _ASKS_FOR_KEY:
        yield from (401, 503)
        if method not in SAFE_METHODS:
            yield from (403, 507)
    yield from (status for call, status in _EXTRA_KEYS.items() if call in calls)
    if any(parameter["in"] == "path" for parameter in parameters):
        yield 404
    if "requestBody" in operation:
        yield 413
    if parameters or "requestBody" in operation or calls & _ASKS_FOR_KEY:
        yield 422


def _response(status: int) -> dict[str, Any]:
    response: dict[str, Any] = {
        "description": _PROBLEMS[status][1],
        "content": {MEDIA_TYPE: {"schema": {"$ref": "#/components/schemas/Problem"}}},
    }
    if status in _HEADERS:
        response["headers"] = {_HEADERS[status]: {"schema": {"type": "string"}}}
    return response
