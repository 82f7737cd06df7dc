"""Messages between service and workers, as tests sign and read them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from lippmann.job.messages import wire
from lippmann.job.messages.events import Event, Presence
from lippmann.job.messages.seals import Seals
from lippmann.key_file import ORDER_KEY_FILE, KeyFile

SEALS = Seals(lambda: (bytes(range(32)),))
"""The seals of tests without a data folder."""


def seals_in(data_dir: Path) -> Seals:
    """Return the seals of a farm by its data folder; the key is made if the farm has not started yet."""
    file = KeyFile(data_dir / ORDER_KEY_FILE)
    file.ensure()
    return Seals(file.keys)


def put_presence(client: Any, presence: Presence, seals: Seals, **options: Any) -> None:
    """Publish a presence as its worker does."""
    client.set(wire.presence_key(presence.name), seals.sealed_presence(presence), **options)


def add_event(client: Any, event: Event, seals: Seals) -> None:
    """Publish an event as its worker does."""
    client.xadd(wire.EVENTS_STREAM, {"event": seals.sealed_event(event)})
