"""Keys and login links."""

from __future__ import annotations

from datetime import datetime
from enum import StrEnum

from pydantic import Field

from service.schemas.answer import Answer


class Role(StrEnum):
    """The role of a key. Each role includes the rights of those before it: viewer, submitter, admin."""

    VIEWER = "viewer"
    SUBMITTER = "submitter"
    ADMIN = "admin"

    def allows(self, needed: Role) -> bool:
        """Return whether this role includes the rights of `needed`."""
        order = list(Role)
        return order.index(self) >= order.index(needed)


class KeyRequest(Answer):
    """A request for a new key."""

    name: str = Field(min_length=1, max_length=100)
    """The name of the owner, shown with the jobs that the key submits."""
    role: Role = Role.SUBMITTER


class Key(Answer):
    """A key, without its secret."""

    id: str
    name: str
    role: Role
    created_at: datetime


class NewKey(Answer):
    """A new key with its secret, which cannot be retrieved later."""

    id: str
    name: str
    role: Role
    key: str
    """The secret to send as `Authorization: Bearer <key>`."""


class KeyList(Answer):
    """All keys, oldest first."""

    items: tuple[Key, ...]


class LoginLink(Answer):
    """A link that logs in one browser, once."""

    url: str
    expires_at: datetime


class Session(Answer):
    """The caller of the request."""

    name: str
    role: Role
