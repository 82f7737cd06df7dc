"""The log of an attempt in the store, while the attempt runs."""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Iterator
from pathlib import Path

from lippmann.errors import LippmannError
from lippmann.plan.artifact_store import ArtifactStore

FIRST_S = 5.0
"""The time after which a growing log is stored first."""
LONGEST_S = 30.0
"""The longest time between two copies; a copy comes after a tenth of the time that the attempt has taken."""


@contextlib.contextmanager
def stored_while_it_grows(
    store: ArtifactStore, name: str, path: Path, *, first_s: float = FIRST_S
) -> Iterator[threading.Thread]:
    """Store copies of a file under a name while the block runs; whoever writes the file stores its end afterwards.

    A copy that cannot be stored is left out: the end of the attempt stores the log again, and reports an error.
    """
    over = threading.Event()

    def run() -> None:
        began_s, copied = time.monotonic(), 0
        while not over.wait(min(LONGEST_S, max(first_s, (time.monotonic() - began_s) / 10))):
            with contextlib.suppress(LippmannError, OSError):
                size = path.stat().st_size
                if size > copied:
                    store.put_file(name, path)
                    copied = size

    thread = threading.Thread(target=run, name=f"log {name}", daemon=True)
    thread.start()
    try:
        yield thread
    finally:
        over.set()
        thread.join()
