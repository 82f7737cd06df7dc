"""The middleware of all requests: request ids, and the limit of the request size."""

from __future__ import annotations

import re
import secrets

from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.errors import TooLarge

TEXT_LIMIT_BYTES = 2_000_000
"""The largest request that is not an upload. The longest valid job file is far smaller."""
_UPLOAD_PATH = "/api/v1/scenes"
_UPLOAD_TYPE = b"multipart/form-data"
_REQUEST_ID = re.compile(rb"[A-Za-z0-9._-]{1,64}")


class RequestId:
    """Gives every request an id: the caller's `X-Request-Id` or a random one. The response carries it too."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle one request."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        given = dict(scope["headers"]).get(b"x-request-id", b"")
        name = given if _REQUEST_ID.fullmatch(given) else secrets.token_hex(8).encode()
        scope.setdefault("state", {})["request_id"] = name.decode()

        async def send_with_id(message: Message) -> None:
            if message["type"] == "http.response.start":
                message["headers"] = [*message["headers"], (b"x-request-id", name)]
            await send(message)

        await self._app(scope, receive, send_with_id)


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
        is_upload = (
            scope.get("method") == "POST" and scope.get("path") == _UPLOAD_PATH and kind.startswith(_UPLOAD_TYPE)
        )
        return self._limit_bytes if is_upload else min(self._limit_bytes, TEXT_LIMIT_BYTES)
