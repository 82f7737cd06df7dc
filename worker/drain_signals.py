"""The signals that drain a worker: SIGUSR1, and SIGTERM where `LIPPMANN_DRAIN_S` gives running attempts time.

=========  ================  =================================================================================
signal     LIPPMANN_DRAIN_S  what the worker does
=========  ================  =================================================================================
SIGUSR1    any               It takes no further order, finishes what it has begun, and ends with code 0.
SIGTERM    0                 It ends its attempts within about a second and ends with code 0.
SIGTERM    more              As SIGUSR1, but after this time as with 0. A second SIGTERM acts as with 0.
SIGHUP     any               As SIGTERM: a terminal that closes sends it. Under nohup it stays ignored.
=========  ================  =================================================================================
"""

from __future__ import annotations

import signal
from collections.abc import Callable
from typing import Any

from worker.duty import Duty


def drain_by_signals(duty: Duty, *, drain_s: float, is_refused: Callable[[], bool]) -> None:
    """Drain from now on at SIGUSR1, and at the first SIGTERM if `drain_s` is not 0; otherwise SIGTERM acts as before.

    SIGHUP acts as SIGTERM, unless it is ignored. The worker itself raises SIGTERM when it has finished.

    Parameters
    ----------
    is_refused
        Returns whether the farm refuses the worker, whose attempts then end at once: nothing of them would count.
    """
    stop_now = signal.getsignal(signal.SIGTERM)
    asked = False

    def drain(*_: Any) -> None:
        nonlocal asked
        asked = True
        duty.drain(ends=True)

    def drain_or_stop(number: int, frame: Any) -> None:
        nonlocal asked
        if drain_s and not asked and not is_refused():
            asked = True
            duty.drain(ends=True, within_s=drain_s)
        elif callable(stop_now):
            stop_now(number, frame)

    signal.signal(signal.SIGUSR1, drain)
    signal.signal(signal.SIGTERM, drain_or_stop)
    if signal.getsignal(signal.SIGHUP) is not signal.SIG_IGN:
        signal.signal(signal.SIGHUP, drain_or_stop)
