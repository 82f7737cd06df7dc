"""How many threads OpenImageIO takes."""

from __future__ import annotations

import OpenImageIO


def limit_threads(count: int) -> None:
    """Let OpenImageIO take `count` threads in this process from now on, for files and for arithmetic.

    Without this it takes one a core, which is too many where every core has a worker of its own. Starts threads, so
    call it in the child that works, never in a parent that forks.
    """
    if count < 1:
        raise ValueError(f"expected at least one thread, got {count}")
    OpenImageIO.attribute("threads", count)
    # For OpenEXR 0 would mean one a core, and -1 means in the calling thread.
    OpenImageIO.attribute("exr_threads", -1 if count == 1 else count)
