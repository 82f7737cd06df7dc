"""The checks of an ID token (OpenID Connect Core 1.0, section 3.1.3.7): signature, issuer, audience, times, nonce."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from authlib.oidc.core import CodeIDToken
from joserfc import jwt
from joserfc.errors import InvalidKeyIdError, JoseError
from joserfc.jwk import KeySet
from joserfc.jws import JWSRegistry

from service.oidc.account import LoginRefused

ALGORITHMS = ("RS256", "RS384", "RS512", "PS256", "PS384", "PS512", "ES256", "ES384", "ES512")
"""The signatures that are accepted. All of them are made with a private key of the provider: `none` and those with a
shared secret, which a public key could pass for, are not among them."""
KEY_TYPES = ("RSA", "EC")
MAX_KEYS = 50
LEEWAY_S = 60
"""The difference of the clocks of the provider and the service that is tolerated."""


class UnknownKey(LoginRefused):
    """The ID token is signed with a key that the provider does not publish."""


def public_keys(document: Mapping[str, Any]) -> KeySet:
    """Return the keys in a document of a provider that may sign ID tokens.

    Raises
    ------
    LoginRefused
        If there are none, or too many.
    """
    listed = document.get("keys")
    given = [key for key in listed if isinstance(key, dict)] if isinstance(listed, list) else []
    wanted = [key for key in given if key.get("kty") in KEY_TYPES and key.get("use", "sig") == "sig"]
    if not 0 < len(wanted) <= MAX_KEYS:
        raise LoginRefused(f"expected 1 to {MAX_KEYS} keys of the provider, got {len(wanted)}")
    try:
        return KeySet.import_key_set({"keys": wanted})
    except (JoseError, ValueError, TypeError, KeyError) as error:
        raise LoginRefused("the keys of the provider cannot be read") from error


def claims_of(
    token: str, keys: KeySet, *, issuer: str, client_id: str, nonce: str, access_token: str, now_s: float
) -> dict[str, Any]:
    """Return the claims of an ID token.

    Raises
    ------
    UnknownKey
        If none of the keys has the id of the one that signed the token.
    LoginRefused
        If anything else is wrong with the token.
    """
    registry = JWSRegistry(algorithms=ALGORITHMS, strict_check_header=False)
    try:
        decoded = jwt.decode(token, keys, algorithms=ALGORITHMS, registry=registry)
        claims = CodeIDToken(
            decoded.claims,
            decoded.header,
            options={
                "iss": {"essential": True, "value": issuer},
                "aud": {"essential": True, "value": client_id},
                "sub": {"essential": True},
                "nonce": {"essential": True, "value": nonce},
            },
            params={"nonce": nonce, "client_id": client_id, "access_token": access_token},
        )
        claims.validate(now=int(now_s), leeway=LEEWAY_S)
    except InvalidKeyIdError as error:
        raise UnknownKey from error
    except (JoseError, ValueError, TypeError, KeyError) as error:
        reason = str(error) if isinstance(error, JoseError) else type(error).__name__
        raise LoginRefused(f"the ID token of the provider is refused: {reason}") from error
    return dict(claims)
