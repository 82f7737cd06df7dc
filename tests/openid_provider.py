"""A small OpenID provider that really signs: authorisation code flow with PKCE, codes that work once, and every lie of
`Lies` on request."""

from __future__ import annotations

import base64
import hashlib
import hmac
import json
import secrets
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from html import escape
from typing import Any
from urllib.parse import urlencode

import uvicorn
from fastapi import FastAPI, Form, Request
from fastapi.responses import HTMLResponse, JSONResponse, RedirectResponse, Response
from joserfc import jwt
from joserfc.jwk import RSAKey

from tests.waiting import ENOUGH_S

CLIENT_ID, CLIENT_SECRET = "lippmann", "a secret: with + and %"


@dataclass
class Lies:
    """The mistakes that the provider makes."""

    claims: dict[str, Any] = field(default_factory=dict)
    """Claims that replace the right ones; None leaves one out."""
    sign: Callable[[Provider, dict[str, Any]], str] | None = None
    """Makes the ID token instead."""
    description: dict[str, Any] = field(default_factory=dict)
    bytes_more: int = 0
    """The size of what follows the description."""
    token_status: int = 200


@dataclass
class Provider:
    """The provider, its keys and its accounts."""

    now_s: Callable[[], float]
    url: str = ""
    account: dict[str, Any] = field(default_factory=lambda: {"sub": "ann-1", "name": "Ann", "groups": ["lab"]})
    key: RSAKey = field(
        default_factory=lambda: RSAKey.generate_key(2048, {"use": "sig", "alg": "RS256"}, auto_kid=True)
    )
    lies: Lies = field(default_factory=Lies)
    asked: list[str] = field(default_factory=list)
    codes: dict[str, dict[str, str]] = field(default_factory=dict)

    def claims(self, nonce: str) -> dict[str, Any]:
        now_s = int(self.now_s())
        right = {"iss": self.url, "aud": CLIENT_ID, "iat": now_s, "exp": now_s + 300, "nonce": nonce, **self.account}
        return {name: value for name, value in (right | self.lies.claims).items() if value is not None}

    def signed(self, claims: dict[str, Any]) -> str:
        return jwt.encode({"alg": "RS256", "kid": self.key.kid}, claims, self.key)

    def new_key(self) -> None:
        self.key = RSAKey.generate_key(2048, {"use": "sig", "alg": "RS256"}, auto_kid=True)


def unsigned(_provider: Provider, claims: dict[str, Any]) -> str:
    """Sign with `none`."""
    return f"{_encoded({'alg': 'none'})}.{_encoded(claims)}."


def signed_with_the_public_key(provider: Provider, claims: dict[str, Any]) -> str:
    """Sign with HS256, and the text of the public key as the shared secret."""
    signed = f"{_encoded({'alg': 'HS256', 'kid': provider.key.kid})}.{_encoded(claims)}"
    secret = provider.key.as_pem(private=False)
    return f"{signed}.{_base64(hmac.digest(secret, signed.encode(), 'sha256'))}"


def signed_with_another_key(provider: Provider, claims: dict[str, Any]) -> str:
    """Sign with a key that has the right id and is another one."""
    other = RSAKey.generate_key(2048)
    return jwt.encode({"alg": "RS256", "kid": provider.key.kid}, claims, other)


def changed_after_signing(provider: Provider, claims: dict[str, Any]) -> str:
    """Change the claims below a signature."""
    header, _, signature = provider.signed(claims).split(".")
    return f"{header}.{_encoded(claims | {'sub': 'root'})}.{signature}"


def _encoded(part: dict[str, Any]) -> str:
    return _base64(json.dumps(part).encode())


def _base64(data: bytes) -> str:
    return base64.urlsafe_b64encode(data).rstrip(b"=").decode()


def _app(provider: Provider) -> FastAPI:
    app = FastAPI()

    @app.get("/.well-known/openid-configuration")
    def describe() -> Response:
        provider.asked.append("description")
        url = provider.url
        described = {
            "issuer": url,
            "authorization_endpoint": f"{url}/authorize",
            "token_endpoint": f"{url}/token",
            "jwks_uri": f"{url}/jwks",
            "token_endpoint_auth_methods_supported": ["client_secret_basic"],
        }
        text = json.dumps(described | provider.lies.description)
        return Response(text + " " * provider.lies.bytes_more, media_type="application/json")

    @app.get("/jwks")
    def keys() -> dict[str, Any]:
        provider.asked.append("keys")
        return {"keys": [provider.key.as_dict(private=False)]}

    @app.get("/authorize")
    def authorize(request: Request) -> Response:
        asked = dict(request.query_params)
        assert (asked["response_type"], asked["client_id"]) == ("code", CLIENT_ID)
        assert asked["code_challenge_method"] == "S256"
        code = secrets.token_urlsafe(16)
        provider.codes[code] = asked
        url = f"{asked['redirect_uri']}?{urlencode({'code': code, 'state': asked['state']})}"
        if "text/html" in request.headers.get("accept", ""):
            return HTMLResponse(f'<link rel="icon" href="data:,"><a href="{escape(url)}">I am Ann</a>')
        return RedirectResponse(url)

    @app.post("/token")
    def exchange(
        request: Request,
        code: str = Form(),
        redirect_uri: str = Form(),
        code_verifier: str = Form(),
        grant_type: str = Form(),
    ) -> Response:
        provider.asked.append("token")
        asked = provider.codes.pop(code, None)
        digest = _base64(hashlib.sha256(code_verifier.encode()).digest())
        credentials = f"{CLIENT_ID}:{'a%20secret%3A%20with%20%2B%20and%20%25'}".encode()
        is_right = (
            request.headers.get("authorization") == f"Basic {base64.b64encode(credentials).decode()}"
            and grant_type == "authorization_code"
            and asked is not None
            and asked["redirect_uri"] == redirect_uri
            and asked["code_challenge"] == digest
        )
        if not is_right or asked is None or provider.lies.token_status != 200:
            status = provider.lies.token_status
            return JSONResponse({"error": "invalid_grant"}, 400 if status == 200 else status)
        claims = provider.claims(asked["nonce"])
        token = (provider.lies.sign or Provider.signed)(provider, claims)
        return JSONResponse({"access_token": "x", "token_type": "Bearer", "id_token": token})

    return app


@contextmanager
def running_provider(now_s: Callable[[], float]) -> Iterator[Provider]:
    """Run a provider on a free port of this machine."""
    provider = Provider(now_s)
    server = uvicorn.Server(uvicorn.Config(_app(provider), host="127.0.0.1", port=0, log_config=None, ws="none"))
    thread = threading.Thread(target=server.run, daemon=True)
    thread.start()
    end_s = time.monotonic() + ENOUGH_S
    while not server.started:
        assert thread.is_alive()
        assert time.monotonic() < end_s
        time.sleep(0.005)
    provider.url = f"http://127.0.0.1:{server.servers[0].sockets[0].getsockname()[1]}"
    yield provider
    server.should_exit = True
    thread.join(ENOUGH_S)
