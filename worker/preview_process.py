"""The process of a worker that renders previews, beside the slots: at most one preview at a time.

It is started when an order waits and ends when none has come for a while, so a farm without previews has none.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Sequence
from contextlib import suppress

import structlog
from redis.exceptions import NoPermissionError, RedisError

from lippmann.job.messages import wire
from worker.preview_orders import PreviewOrders
from worker.settings import WorkerSettings

END_S = 3.0
"""The time that the process has to end before it is killed."""
PROGRAM = "worker.tasks.previews.serve"

log = structlog.get_logger()


class PreviewProcess:
    """Starts the process when it is needed, and ends it with the worker.

    Parameters
    ----------
    settings
        The settings of the worker.
    orders
        The orders for the worker.
    command
        The command of the process; by default that of `worker.tasks.previews.serve`.
    """

    def __init__(self, settings: WorkerSettings, orders: PreviewOrders, command: Sequence[str] = ()) -> None:
        self._settings = settings
        self._orders = orders
        self._command = command
        self._process: subprocess.Popen[bytes] | None = None
        self.is_offered = settings.previews and self._is_permitted()
        """True if this worker renders previews."""

    def look_after(self, takes_orders: bool, /) -> None:
        """Start the process if an order waits; the consumer calls this every second."""
        if not self.is_offered or not takes_orders or self.is_running():
            return
        with suppress(RedisError):
            if self._orders.are_waiting():
                self._start()

    def is_running(self) -> bool:
        """Return whether the process runs."""
        return self._process is not None and self._process.poll() is None

    def end(self) -> None:
        """End the process."""
        process, self._process = self._process, None
        if process is None:
            return
        process.terminate()
        try:
            process.wait(END_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()

    def _start(self) -> None:
        # The name of the worker may be made of the id of its process, so the other process is told it.
        env = os.environ | {"LIPPMANN_WORKER_NAME": self._settings.worker_name, "OPENBLAS_NUM_THREADS": "1"}
        command = self._command or [sys.executable, "-P", "-m", PROGRAM, str(os.getpid())]
        self._process = subprocess.Popen(command, env=env, stdin=subprocess.DEVNULL)

    def _is_permitted(self) -> bool:
        try:
            self._orders.are_waiting()
        except NoPermissionError as error:
            log.error(
                f"the user of this worker at the broker has no right to {wire.PREVIEWS}*, so it renders no previews; "
                "renew the users of the broker from deploy/broker-users.acl",
                error=str(error),
            )
            return False
        except RedisError:  # the broker is away; it may be back when previews are wanted
            return True
        return True
