"""The farm as others use it: starts a keeper, hears from it, ends it."""

from __future__ import annotations

import json
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from typing import IO, Any, cast

from lippmann.client.address import Address
from lippmann.errors import BadInput, FarmFailed, LippmannError
from lippmann.farm.supervisor.descendants import adopt_orphans, kill_all_below
from lippmann.farm.supervisor.plan import FarmPlan

KILL_WITHIN_S = 10.0
"""How long a keeper may take to end everything at once."""

Listener = Callable[[Mapping[str, Any]], None]


class Farm:
    """A farm that was started."""

    def __init__(self, keeper: subprocess.Popen[str], on_event: Listener) -> None:
        self.address = Address(url="", key="")
        """Where the service is, once the farm is up."""
        self._keeper = keeper
        self._words = cast(IO[str], keeper.stdin)
        self._answers = cast(IO[str], keeper.stdout)
        self._on_event = on_event
        self._up_or_over = threading.Event()
        self._over = threading.Event()
        self._failure: LippmannError = FarmFailed("the farm ended by itself")
        threading.Thread(target=self._hear, name="keeper", daemon=True).start()

    def wait_until_up(self) -> None:
        """Wait until the service answers.

        Raises
        ------
        LippmannError
            If the farm cannot run: why, with the exit code for it.
        """
        self._up_or_over.wait()
        if not self.address.url:
            raise self._failure

    def wait(self) -> None:
        """Wait for ever.

        Raises
        ------
        LippmannError
            If the farm ends by itself: why.
        """
        self._over.wait()
        raise self._failure

    def end(self) -> None:
        """End the farm in order; at once, if Ctrl-C comes meanwhile."""
        try:
            self._ask_to_stop()
            self._keeper.wait()
        except KeyboardInterrupt:
            self._on_event({"event": "hurrying"})
        finally:
            with suppress(BrokenPipeError):
                self._words.close()  # the keeper hears that, and ends everything at once
            with suppress(subprocess.TimeoutExpired):
                self._keeper.wait(timeout=KILL_WITHIN_S)
            kill_all_below()

    def _hear(self) -> None:
        for line in self._answers:
            event = json.loads(line)
            if event["event"] == "ready":
                self.address = Address(url=event["url"], key=event["key"])
                self._up_or_over.set()
            elif event["event"] == "failed":
                kind = BadInput if event["code"] == BadInput.code else FarmFailed
                self._failure = kind(event["message"])
            else:
                self._on_event(event)
        self._over.set()
        self._up_or_over.set()

    def _ask_to_stop(self) -> None:
        with suppress(BrokenPipeError):  # it is over already
            self._words.write("stop\n")
            self._words.flush()


@contextmanager
def running_farm(plan: FarmPlan, *, on_event: Listener = lambda event: None) -> Iterator[Farm]:
    """Run a one-machine farm while the context lasts.

    For a process that has no other children: at the end everything below the process is ended.
    """
    adopt_orphans()
    command = [sys.executable, "-P", "-m", "lippmann.farm.supervisor", plan.to_json()]
    # A session of its own: Ctrl-C reaches us, and we end the farm in order.
    keeper = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, start_new_session=True)
    farm = Farm(keeper, on_event)
    try:
        farm.wait_until_up()
        yield farm
    finally:
        farm.end()
