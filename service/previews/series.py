"""The previews that this process waits for: the newest of each series, and a few series of each key."""

from __future__ import annotations

import secrets
from collections import Counter
from dataclasses import dataclass, field

from service.errors import TooManyRequests

RETRY_S = 1.0
"""The time after which a key with too many previews may try again; most take less."""


@dataclass(eq=False)
class Ticket:
    """One preview that is waited for."""

    key_id: str
    stream: str
    """The name of the series among those of the key; empty for a series of its own."""
    worker: str = ""
    """The worker that has the order."""
    is_replaced: bool = False
    """True when a newer preview of the series was asked for."""
    id: str = field(default_factory=lambda: secrets.token_hex(16))

    @property
    def series(self) -> str:
        """The name of the series on the whole farm."""
        return f"{self.key_id}:{self.stream or self.id}"


class PreviewSeries:
    """The tickets of this process. All methods are called in its event loop."""

    def __init__(self, *, by_key: int) -> None:
        self._by_key = by_key
        self._newest: dict[str, Ticket] = {}

    def open(self, key_id: str, stream: str) -> Ticket:
        """Return the ticket of a new preview, which replaces the one before it in its series.

        Raises
        ------
        TooManyRequests
            If the key waits for previews of too many series.
        """
        ticket = Ticket(key_id, stream)
        before = self._newest.get(ticket.series)
        if before is None and sum(other.key_id == key_id for other in self._newest.values()) >= self._by_key:
            expected = f"at most {self._by_key} (LIPPMANN_PREVIEWS_PER_KEY of the farm)"
            raise TooManyRequests(f"this key waits for other previews, expected {expected}", retry_after_s=RETRY_S)
        if before is not None:
            before.is_replaced = True
        self._newest[ticket.series] = ticket
        return ticket

    def close(self, ticket: Ticket) -> None:
        """Forget a preview that is not waited for any more."""
        if self._newest.get(ticket.series) is ticket:
            del self._newest[ticket.series]

    @property
    def busy(self) -> Counter[str]:
        """The number of previews that workers have, by their names."""
        return Counter(ticket.worker for ticket in self._newest.values() if ticket.worker)
