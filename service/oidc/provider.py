"""The requests to an OpenID provider. Its answers are bounded in size and time, and no redirect is followed."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any
from urllib.parse import quote, urlencode, urlsplit

import httpx
from joserfc.jwk import KeySet

from lippmann.errors import InvalidText
from lippmann.key_file import read_secret
from lippmann.untrusted.json_text import read_json
from service.errors import ProviderUnavailable
from service.oidc.account import LoginRefused
from service.oidc.handshake import Handshake
from service.oidc.id_token import UnknownKey, claims_of, public_keys
from service.settings import Settings, is_secure_url

MAX_BYTES = 262_144
ANSWER_S = 10.0
"""The time in which an answer must have arrived completely."""
KEPT_S = 3600.0
"""The time for which the description and the keys of the provider are kept."""
RENEWED_AFTER_S = 30.0
"""The time after which the keys are read again for a token that none of them has signed."""
AT_ONCE = 16
"""The number of requests to the provider at the same time."""


@dataclass(frozen=True)
class Description:
    """The description that a provider gives of itself (OpenID Connect Discovery 1.0), as far as it is used."""

    authorization_url: str
    token_url: str
    token_methods: tuple[str, ...]
    keys: KeySet
    read_s: float


@dataclass
class Provider:
    """The OpenID provider of a farm.

    Parameters
    ----------
    settings
        The settings `oidc_...`.
    now_s
        Returns seconds since 1970, UTC.
    """

    settings: Settings
    now_s: Callable[[], float] = time.time
    steady: Callable[[], float] = time.monotonic
    _known: Description | None = None
    _reading: asyncio.Lock = field(default_factory=asyncio.Lock)
    _room: asyncio.Semaphore = field(default_factory=lambda: asyncio.Semaphore(AT_ONCE))

    @property
    def return_url(self) -> str:
        """The URL to which the provider sends the browser back."""
        return f"{self.settings.base_url}/login/oidc/callback"

    async def login_url(self, handshake: Handshake) -> str:
        """Return the URL at which a browser begins to log in.

        Raises
        ------
        ProviderUnavailable
            If the provider does not answer, or with something else.
        """
        described = await self._description()
        query = {
            "response_type": "code",
            "client_id": self.settings.oidc_client_id,
            "redirect_uri": self.return_url,
            "scope": self.settings.oidc_scopes,
            "state": handshake.state,
            "nonce": handshake.nonce,
            "code_challenge": handshake.challenge,
            "code_challenge_method": "S256",
        }
        separator = "&" if urlsplit(described.authorization_url).query else "?"
        return described.authorization_url + separator + urlencode(query)

    async def claims(self, code: str, handshake: Handshake) -> dict[str, Any]:
        """Exchange a code for the claims of an account.

        Raises
        ------
        LoginRefused
            If the provider refuses the code, or its ID token is not valid.
        ProviderUnavailable
            If the provider does not answer, or with something else.
        """
        described = await self._description()
        answer = await self._exchange(described, code, handshake)
        token, access_token = answer.get("id_token"), answer.get("access_token")
        if not isinstance(token, str):
            raise LoginRefused("expected an ID token of the provider, got none")
        access_token = access_token if isinstance(access_token, str) else ""
        try:
            return self._checked(token, access_token, described, handshake)
        except UnknownKey:
            if self.steady() - described.read_s < RENEWED_AFTER_S:
                raise
        # The provider may have new keys.
        return self._checked(token, access_token, await self._description(not_before_s=self.steady()), handshake)

    def _checked(self, token: str, access_token: str, described: Description, handshake: Handshake) -> dict[str, Any]:
        return claims_of(
            token,
            described.keys,
            issuer=self.settings.oidc_issuer,
            client_id=self.settings.oidc_client_id,
            nonce=handshake.nonce,
            access_token=access_token,
            now_s=self.now_s(),
        )

    async def _exchange(self, described: Description, code: str, handshake: Handshake) -> dict[str, Any]:
        client_id, file = self.settings.oidc_client_id, self.settings.oidc_client_secret_file
        form = {
            "grant_type": "authorization_code",
            "code": code,
            "redirect_uri": self.return_url,
            "code_verifier": handshake.verifier,
        }
        auth = None
        secret = await asyncio.to_thread(read_secret, file) if file is not None else ""
        if not secret:
            form |= {"client_id": client_id}
        elif "client_secret_basic" in described.token_methods:
            auth = httpx.BasicAuth(quote(client_id, safe=""), quote(secret, safe=""))  # RFC 6749, section 2.3.1
        else:
            form |= {"client_id": client_id, "client_secret": secret}
        status, answer = await self._ask("POST", described.token_url, data=form, auth=auth)
        if status != 200:
            raise LoginRefused("the provider refuses the code of this login; try again")
        return answer

    async def _description(self, *, not_before_s: float | None = None) -> Description:
        async with self._reading:
            oldest_s = self.steady() - KEPT_S if not_before_s is None else not_before_s
            if self._known is None or self._known.read_s < oldest_s:
                self._known = await self._read()
            return self._known

    async def _read(self) -> Description:
        issuer = self.settings.oidc_issuer
        found = await self._get(issuer.rstrip("/") + "/.well-known/openid-configuration")
        if found.get("issuer") != issuer:
            raise ProviderUnavailable(f"expected the description of the issuer {issuer}, got one of another issuer")
        urls = [found.get(name) for name in ("authorization_endpoint", "token_endpoint", "jwks_uri")]
        texts = [url for url in urls if isinstance(url, str) and is_secure_url(url)]
        if len(texts) != len(urls):
            raise ProviderUnavailable("expected https URLs of the provider in its description, got others")
        methods = found.get("token_endpoint_auth_methods_supported")
        keys = public_keys(await self._get(texts[2]))
        listed = tuple(map(str, methods)) if isinstance(methods, list) else ("client_secret_basic",)
        authorization_url, token_url, _ = texts
        return Description(authorization_url, token_url, listed, keys, self.steady())

    async def _get(self, url: str) -> dict[str, Any]:
        status, answer = await self._ask("GET", url)
        if status != 200:
            raise ProviderUnavailable(f"expected an answer of the provider with status 200, got {status}")
        return answer

    async def _ask(
        self, method: str, url: str, *, data: Mapping[str, str] | None = None, auth: httpx.BasicAuth | None = None
    ) -> tuple[int, dict[str, Any]]:
        """Return the status of an answer, and its JSON object if it is no error."""
        headers = {"Accept": "application/json", "Accept-Encoding": "identity"}
        try:
            async with self._room, asyncio.timeout(ANSWER_S), httpx.AsyncClient(timeout=ANSWER_S) as client:
                request = client.stream(method, url, data=data, auth=auth, headers=headers)
                async with request as response:
                    body = bytearray()
                    async for piece in response.aiter_raw():
                        body += piece
                        if len(body) > MAX_BYTES:
                            raise ProviderUnavailable(f"expected at most {MAX_BYTES} bytes of the provider, got more")
        except (httpx.HTTPError, httpx.InvalidURL, TimeoutError, OSError) as error:
            raise ProviderUnavailable from error
        if response.status_code >= 500:
            raise ProviderUnavailable(f"the provider has an error of its own: status {response.status_code}")
        return response.status_code, _object_in(bytes(body)) if response.status_code == 200 else {}


def _object_in(body: bytes) -> dict[str, Any]:
    try:
        answer = read_json(body, field="provider")
    except InvalidText as error:
        raise ProviderUnavailable("expected JSON of the provider, got another text") from error
    if not isinstance(answer, dict):
        raise ProviderUnavailable("expected a JSON object of the provider, got another value")
    return answer
