"""Keys, usage and the audit log as text."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from lippmann.terminal.progress import time_text
from lippmann.terminal.table import table

if TYPE_CHECKING:
    from service.schemas.access import AuditEntry, Key
    from service.schemas.usage import Usage
    from service.schemas.worker_keys import WorkerKey


def key_table(keys: Iterable[Key], workers: Iterable[WorkerKey] = ()) -> str:
    """Return keys and worker keys, one a line, without secrets."""
    rows = [
        (
            key.id,
            key.role.value,
            time_text(key.created_at),
            "never" if key.expires_at is None else time_text(key.expires_at),
            "never" if key.used_at is None else time_text(key.used_at),
            "itself" if key.owner_id == key.id else key.owner_id,
            key.name,
        )
        for key in keys
    ]
    rows += [
        (
            key.id,
            "worker",
            time_text(key.created_at),
            "never" if key.expires_at is None else time_text(key.expires_at),
            "never" if key.used_at is None else time_text(key.used_at),
            "",
            key.name,
        )
        for key in workers
    ]
    return table(("id", "role", "created", "expires", "last used", "owner", "name"), rows)


def audit_table(entries: Iterable[AuditEntry]) -> str:
    """Return changes, one a line."""
    rows = [
        (time_text(one.at), one.name, one.key_id, one.action, one.subject, one.detail, one.address) for one in entries
    ]
    return table(("when", "who", "key", "what", "of", "detail", "from"), rows) if rows else "No changes."


def usage_table(found: Usage) -> str:
    """Return the limits of a key, one a line, with what its owner uses of them."""
    rows = [
        (item.name, "" if item.used is None else f"{item.used:.12g}", f"{item.limit:.12g}", item.source)
        for item in found.items
    ]
    return table(("limit", "used", "of", "set by"), rows)
