"""The bounded reader of JSON bodies, in front of every route."""

from __future__ import annotations

import anyio
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from lippmann.errors import InvalidText
from lippmann.untrusted.json_text import read_json
from service.errors import Invalid

_QUICK_BYTES = 20_000
"""A longer body is read in a thread, so that other requests do not wait."""


class JsonBodies:
    """Refuses a JSON body that exceeds the limits of `lippmann.untrusted.json_text` before a route parses it."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle one request."""
        is_json = scope["type"] == "http" and any(
            name == b"content-type" and b"json" in value.lower() for name, value in scope["headers"]
        )
        await self._app(scope, _checked(receive) if is_json else receive, send)


def _checked(receive: Receive) -> Receive:
    """Return a `receive` whose first message is the whole body, after the check."""
    is_read = False

    async def receive_checked() -> Message:
        nonlocal is_read
        if is_read:
            return await receive()
        is_read = True
        body = bytearray()
        more = True
        while more:
            message = await receive()
            if message["type"] != "http.request":
                return message
            body += message.get("body", b"")
            more = message.get("more_body", False)
        await _check(bytes(body))
        return {"type": "http.request", "body": bytes(body), "more_body": False}

    return receive_checked


async def _check(body: bytes) -> None:
    if not body:
        return
    try:
        if len(body) <= _QUICK_BYTES:
            read_json(body, field="body")
        else:
            await anyio.to_thread.run_sync(lambda: read_json(body, field="body"))
    except InvalidText as error:
        raise Invalid(error.message, problems=error.problems) from error
