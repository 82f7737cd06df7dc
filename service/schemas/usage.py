"""The use of the farm by an owner."""

from __future__ import annotations

from service.schemas.answer import Answer


class UsageItem(Answer):
    """A limit, and how much of it is used."""

    name: str
    """The name of the limit, as in `limits` of a key."""
    used: float | None
    """The amount that the owner has now; null for a limit of a single job, and for `picture_s_per_minute`."""
    limit: float
    source: str
    """Who sets the limit: a setting of the farm, or the key of the request if that is lower."""


class Usage(Answer):
    """The use of the farm by the owner of the key of the request, and the limits of that key."""

    owner_id: str
    items: tuple[UsageItem, ...]
