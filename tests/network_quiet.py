"""Tests that change the network interfaces of this machine, and those that need them to stay.

When an interface appears or disappears, Chromium ends its requests with ERR_NETWORK_CHANGED. Test processes run at the
same time, so they share a lock file.
"""

from __future__ import annotations

import fcntl
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

_LOCK = Path(tempfile.gettempdir(), "lippmann-tests-network.lock")


@contextmanager
def unchanged_network() -> Iterator[None]:
    """Keep other test processes from changing interfaces meanwhile."""
    with _locked(fcntl.LOCK_SH):
        yield


@contextmanager
def changing_network() -> Iterator[None]:
    """Wait until no test process needs the interfaces to stay."""
    with _locked(fcntl.LOCK_EX):
        yield


@contextmanager
def _locked(kind: int) -> Iterator[None]:
    with _LOCK.open("ab") as file:
        fcntl.flock(file, kind)
        yield
