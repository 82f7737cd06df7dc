"""The middleware of all requests: HEAD, prefix, request ids, security headers, rates, and limit of their size."""

from __future__ import annotations

import asyncio
import re
import secrets
import time

import structlog
from fastapi import Request
from starlette.routing import Match
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from lippmann.telemetry import span
from service.browser_sessions import OVERLAP_S
from service.connections import HOLD
from service.dependencies import OFFER
from service.errors import TooLarge, TooManyRequests
from service.instruments import REQUEST_S
from service.rate_limits import RateLimit, RefusalBrake
from service.routes.problems import LOG_IDS, answer, head_is_get
from service.schemas.links import API

TEXT_LIMIT_BYTES = 2_000_000
"""The largest request that is not an upload. The longest valid job file is far smaller."""
_UPLOAD_PATH = "/api/v1/scenes"
_UPLOAD_TYPE = b"multipart/form-data"
REFUSALS = frozenset({401, 429})
"""The statuses of refusals that anybody can cause, as often as they like."""
_METHODS = frozenset({"GET", "HEAD", "POST", "PUT", "PATCH", "DELETE", "OPTIONS"})
STRICT_TRANSPORT = (b"strict-transport-security", b"max-age=31536000")
_JOB_PATH = re.compile(rf"{API}/(?:jobs|links)/([A-Za-z0-9-]{{1,32}})(?:/|$)")
_REQUEST_ID = re.compile(rb"[A-Za-z0-9._-]{1,64}")


class RequestTimes:
    """Measures the time until the answer to a request begins, by the route and not by the path, which has ids."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle one request."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        begun_s = time.perf_counter()

        ids = scope.get("state", {}).get(LOG_IDS, {})
        parent = dict(scope["headers"]).get(b"traceparent", b"").decode("latin-1")
        with span(scope["method"], parent=parent, **ids) as made:

            async def send_measured(message: Message) -> None:
                if message["type"] == "http.response.start":
                    status, seconds = message["status"], time.perf_counter() - begun_s
                    method, route = _route_of(scope)
                    REQUEST_S.labels(method, route, f"{status // 100}xx").observe(seconds)
                    made.rename(f"{method} {route}")
                    made.note(status=status)
                await send(message)

            await self._app(scope, receive, send_measured)


def _route_of(scope: Scope) -> tuple[str, str]:
    """Return the method and the route of a request, of which there are few; a path would have ids."""
    route = getattr(scope.get("route"), "path", "none")
    is_of_api = scope["path"].removeprefix(scope.get("root_path", "")).startswith(f"{API}/")
    method = scope["method"] if scope["method"] in _METHODS else "other"
    return method, f"{API}{route}" if is_of_api and route != "none" else route


class HeadAsGet:
    """Answers HEAD as GET without the body, where a route has no HEAD of its own."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle one request."""
        if scope["type"] != "http" or scope["method"] != "HEAD" or not head_is_get(scope) or _has_route(scope):
            await self._app(scope, receive, send)
            return

        async def send_no_body(message: Message) -> None:
            if message["type"] == "http.response.start":
                await send(message)
                await send({"type": "http.response.body", "body": b""})  # A stream ends here too.

        await self._app({**scope, "method": "GET"}, receive, send_no_body)


def _has_route(scope: Scope) -> bool:
    return any(route.matches(scope)[0] is Match.FULL for route in scope["app"].routes)


class PathPrefix:
    """Accepts paths with and without the prefix of the public URL, whether or not a reverse proxy removes it.

    Routes see the path without the prefix, and URLs that are made of a request have it.
    """

    def __init__(self, app: ASGIApp, *, prefix: str) -> None:
        self._app = app
        self._prefix = prefix

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle one request."""
        if scope["type"] == "http":
            path = scope["path"]
            has_prefix = path == self._prefix or path.startswith(f"{self._prefix}/")
            scope = {**scope, "path": path if has_prefix else self._prefix + path, "root_path": self._prefix}
        await self._app(scope, receive, send)


class ResponseHeaders:
    """Adds to every response its request id and the headers that no page or file may lack.

    The request id is the caller's `X-Request-Id` or a random one. Every line that is logged meanwhile carries it, and
    the job that the path names.

    Parameters
    ----------
    is_https
        True if users reach the service over TLS; browsers then never use plain HTTP again.
    """

    def __init__(self, app: ASGIApp, *, is_https: bool) -> None:
        self._app = app
        self._fixed = [(b"x-content-type-options", b"nosniff"), *([STRICT_TRANSPORT] if is_https else [])]

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle one request."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        given = dict(scope["headers"]).get(b"x-request-id", b"")
        name = given if _REQUEST_ID.fullmatch(given) else secrets.token_hex(8).encode()
        ids = {"request_id": name.decode(), **_named_job(scope["path"])}
        scope.setdefault("state", {}).update({"request_id": name.decode(), LOG_IDS: ids})

        async def send_with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                given = list(message.get("headers", ()))
                known = {header.lower() for header, _ in given}
                missing = [(header, value) for header, value in self._fixed if header not in known]
                message["headers"] = [*given, *missing, *_offered(scope), (b"x-request-id", name)]
            await send(message)

        with structlog.contextvars.bound_contextvars(**ids):
            await self._app(scope, receive, send_with_headers)


def _named_job(path: str) -> dict[str, str]:
    """Return the job that a path names, for the log.

    >>> _named_job("/api/v1/jobs/1q9gd6e00mbne4fz7/tasks"), _named_job("/api/v1/jobs")
    ({'job': '1q9gd6e00mbne4fz7'}, {})
    """
    found = _JOB_PATH.search(path)
    return {} if found is None else {"job": found[1]}


def _offered(scope: Scope) -> list[tuple[bytes, bytes]]:
    """Return the header of a new session cookie, if the request made one in time for the browser to use it."""
    header, made_s = scope["state"].pop(OFFER, (b"", 0.0))
    is_late = time.monotonic() - made_s > OVERLAP_S / 2  # By then another request may have made another one.
    return [] if not header or is_late else [(b"set-cookie", header)]


class AddressRate:
    """Refuses requests of an address that sends too many, before anything else is done for them.

    Refusals for this reason, or for lack of a key, are held back from an address that gets many, for as long as the
    client waits for them.
    """

    def __init__(self, app: ASGIApp, *, rate: RateLimit) -> None:
        self._app = app
        self._rate = rate
        self._brake = RefusalBrake(rate.per_minute)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle one request."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        app, request = self._app, Request(scope)
        wait = scope.get("extensions", {}).get(HOLD, asyncio.sleep)
        address = address_of(request)
        try:
            await self._rate.check(address, "this address sends too many requests")
        except TooManyRequests as error:
            app = await answer(request, error)

        async def send_refusals_later(message: Message) -> None:
            if message["type"] == "http.response.start" and message["status"] in REFUSALS:
                await self._brake.hold_back(address, wait)
            await send(message)

        await app(scope, receive, send_refusals_later)


def address_of(request: Request) -> str:
    """Return the address of the client of a request, which a trusted proxy may have named."""
    return request.client.host if request.client else ""


class BodyLimit:
    """Refuses requests that are too large. The received bytes count, not the Content-Length."""

    def __init__(self, app: ASGIApp, *, limit_bytes: int) -> None:
        self._app = app
        self._limit_bytes = limit_bytes

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle one request."""
        received = 0
        limit_bytes = self._limit_of(scope)

        async def count() -> Message:
            nonlocal received
            message = await receive()
            received += len(message.get("body", b""))
            if received > limit_bytes:
                raise TooLarge(f"expected at most {limit_bytes} bytes, got more")
            return message

        await self._app(scope, count if scope["type"] == "http" else receive, send)

    def _limit_of(self, scope: Scope) -> int:
        # Only the upload of a scene is read by its route, into a file and after authentication; all others use memory.
        kind = dict(scope.get("headers", ())).get(b"content-type", b"").lower()
        path = scope.get("path", "").removeprefix(scope.get("root_path", ""))
        is_upload = scope.get("method") == "POST" and path == _UPLOAD_PATH and kind.startswith(_UPLOAD_TYPE)
        return self._limit_bytes if is_upload else min(self._limit_bytes, TEXT_LIMIT_BYTES)
