"""Ctrl-C reaches what a test run starts, also where a script started the run in its background."""

from __future__ import annotations

import signal


def heed_ctrl_c() -> None:
    """Start children as an interactive shell does: they do not ignore SIGINT.

    A shell without job control ignores SIGINT for what it starts in the background. Children inherit that a signal is
    ignored, but not that it is handled. With a handler that does nothing, this process goes on as before.
    """
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, lambda *_: None)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, [signal.SIGINT])
