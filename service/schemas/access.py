"""Keys and login links."""

from __future__ import annotations

from datetime import datetime
from enum import StrEnum

from pydantic import Field

from service.schemas.answer import Answer


class Role(StrEnum):
    """What a caller may do; each role may do what those before it may."""

    VIEWER = "viewer"
    SUBMITTER = "submitter"
    ADMIN = "admin"

    def allows(self, needed: Role) -> bool:
        """Return whether this role may do what `needed` may."""
        order = list(Role)
        return order.index(self) >= order.index(needed)


class KeyWish(Answer):
    """The key that is asked for."""

    name: str = Field(min_length=1, max_length=100)
    role: Role = Role.SUBMITTER


class Key(Answer):
    """A key, without its secret."""

    id: str
    name: str
    role: Role
    created_at: datetime


class NewKey(Answer):
    """A key, this once with its secret."""

    id: str
    name: str
    role: Role
    key: str


class KeyList(Answer):
    """Keys, oldest first."""

    items: tuple[Key, ...]


class LoginLink(Answer):
    """A link that logs a browser in, once."""

    url: str
    expires_at: datetime


class Session(Answer):
    """Who is calling."""

    name: str
    role: Role
