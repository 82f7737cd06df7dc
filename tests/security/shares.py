"""Share work among processes, one for each share: a share that crashes its process is found, and ends no other."""

from __future__ import annotations

import multiprocessing
import time
from collections.abc import Callable, Iterable, Iterator
from multiprocessing.connection import Connection, wait
from multiprocessing.context import ForkServerProcess
from typing import Any, TypeVar

Share = TypeVar("Share")
Result = TypeVar("Result")


def run_shares(
    work: Callable[[Share], Result], shares: Iterable[Share], *, processes: int, until_s: float = float("inf")
) -> Iterator[tuple[Share, Result | None]]:
    """Yield each share with its result, in the order in which they end; the result of a process that crashed is None.

    Parameters
    ----------
    work
        A function of a module.
    shares
        It is asked for the next share when a process is free.
    processes
        The number of processes at the same time.
    until_s
        No share begins after this time of the monotonic clock.
    """
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload([work.__module__])
    waiting, running = iter(shares), dict[Connection, tuple[Share, ForkServerProcess]]()
    try:
        while True:
            while len(running) < processes and time.monotonic() < until_s:
                for share in waiting:
                    receiver, sender = context.Pipe(duplex=False)
                    process = context.Process(target=_send, args=(work, share, sender), daemon=True)
                    process.start()
                    sender.close()
                    running[receiver] = share, process
                    break
                else:
                    break
            if not running:
                return
            for ready in wait(list(running)):
                assert isinstance(ready, Connection)
                share, process = running.pop(ready)
                yield share, _received(ready)
                process.join()
    finally:
        for _, process in running.values():
            process.terminate()
            process.join()


def _send(work: Callable[[Share], Result], share: Share, sender: Connection) -> None:
    sender.send(work(share))


def _received(receiver: Connection) -> Any:
    try:
        return receiver.recv()
    except EOFError:
        return None
    finally:
        receiver.close()
