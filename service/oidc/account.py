"""The owner and the role of an account, by the claims that its provider makes."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from service.errors import Forbidden, Unauthorized
from service.schemas.access import PRINTABLE, Role
from service.settings import Settings

OWNER_PREFIX = "oidc:"
MAX_SUBJECT = 95
"""The longest subject, in characters, so that the owner fits its column."""
MAX_NAME = 64
_PRINTABLE = re.compile(PRINTABLE)


class LoginRefused(Unauthorized):
    """The login with the provider has failed; try again."""


class AccountRefused(Forbidden):
    """The account has no access to this farm."""


@dataclass(frozen=True)
class Account:
    """A user whom the provider knows."""

    owner_id: str
    name: str
    role: Role


def account_of(claims: Mapping[str, Any], settings: Settings) -> Account:
    """Return the account that claims describe, with the highest role of its groups.

    Raises
    ------
    LoginRefused
        If the subject cannot be the name of an owner.
    AccountRefused
        If no group of the account has a role, and there is no role for all others.
    """
    subject = claims.get("sub")
    if not isinstance(subject, str) or len(subject) > MAX_SUBJECT or not _PRINTABLE.match(subject):
        raise LoginRefused(f"expected a subject of 1 to {MAX_SUBJECT} printable characters, got another one")
    groups = _values(claims, settings.oidc_roles_claim)
    roles = [role for group, role in settings.oidc_roles.items() if group in groups]
    if not roles and settings.oidc_default_role is None:
        raise AccountRefused(
            f"the account {_name(claims, subject)!r} has no access to this farm; ask its administrator"
        )
    role = max(roles, key=list(Role).index) if roles else settings.oidc_default_role or Role.VIEWER
    return Account(owner_id=OWNER_PREFIX + subject, name=_name(claims, subject), role=role)


def _name(claims: Mapping[str, Any], subject: str) -> str:
    for claim in ("name", "preferred_username", "email"):
        value = claims.get(claim)
        if isinstance(value, str) and _PRINTABLE.match(value):
            return value[:MAX_NAME]
    return subject[:MAX_NAME]


def _values(claims: Mapping[str, Any], path: str) -> frozenset[str]:
    """Return the texts of a claim. A name with dots is that of a claim inside others, unless a claim is called so."""
    found: Any = claims.get(path)
    if found is None:
        found = claims
        for name in path.split("."):
            found = found.get(name) if isinstance(found, Mapping) else None
    listed = found if isinstance(found, list) else [found]
    return frozenset(value for value in listed if isinstance(value, str))
