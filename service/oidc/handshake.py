"""The values that one login remembers between the request that begins it and the one that completes it.

The browser carries it in a cookie, so that nobody fills the database before login. The state ties the answer of the
provider to this browser, the nonce ties the ID token to this login, and the verifier ties the code to this login.
"""

from __future__ import annotations

import hmac
import secrets
from dataclasses import astuple, dataclass

from authlib.oauth2.rfc7636 import create_s256_code_challenge

SECRET_BYTES = 32
LASTS_S = 600
"""The time for which a browser may take to log in at the provider."""
MAX_COOKIE = 200


@dataclass(frozen=True)
class Handshake:
    """The secrets of one login."""

    state: str
    nonce: str
    verifier: str

    @classmethod
    def new(cls) -> Handshake:
        """Return new secrets of 256 bits each."""
        return cls(*(secrets.token_urlsafe(SECRET_BYTES) for _ in range(3)))

    @classmethod
    def from_cookie(cls, cookie: str | None) -> Handshake | None:
        """Return the secrets in a cookie; None if it is another one."""
        parts = (cookie or "")[:MAX_COOKIE].split(".")
        return cls(*parts) if len(parts) == 3 and all(parts) else None

    @property
    def cookie(self) -> str:
        """The value of the cookie."""
        return ".".join(astuple(self))

    @property
    def challenge(self) -> str:
        """The SHA-256 of the verifier, which goes to the provider first (RFC 7636, section 4.2)."""
        return str(create_s256_code_challenge(self.verifier))

    def is_answered_by(self, state: str) -> bool:
        """Return whether the answer of a provider belongs to this login."""
        return hmac.compare_digest(self.state.encode(), state.encode())
