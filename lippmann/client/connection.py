"""The service that a command works with: where it is, and a client of it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from lippmann.client.address import find_address

if TYPE_CHECKING:
    from lippmann.client.client import Client


@dataclass(frozen=True)
class Connection:
    """The service as `--url`, `--key` and `--data-dir` name it."""

    url: str | None
    key: str | None
    data_dir: Path

    @contextmanager
    def client(self, *, patience_s: float = 3.0) -> Iterator[Client]:
        """Open a client of the service, and close it at the end of the context.

        Parameters
        ----------
        patience_s
            How long the client waits for a service that does not answer, s.

        Raises
        ------
        BadInput, NotAllowed, Unreachable
            As in `find_address`.
        """
        from lippmann.client.client import Client  # on first use: it imports the HTTP library

        address = find_address(url=self.url, key=self.key, data_dir=self.data_dir)
        with Client(address.url, address.key, patience_s=patience_s) as client:
            yield client
