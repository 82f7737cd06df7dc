"""A one-machine farm as a context: it starts a supervisor, receives its events and stops it."""

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
"""The time in which a supervisor must have killed all its processes, s."""

Listener = Callable[[Mapping[str, Any]], None]


class Farm:
    """A farm that was started."""

    def __init__(self, supervisor: subprocess.Popen[str], on_event: Listener) -> None:
        self.address = Address(url="", key="")
        """The address of the service, once the farm is up."""
        self._supervisor = supervisor
        self._commands = cast(IO[str], supervisor.stdin)
        self._events = cast(IO[str], supervisor.stdout)
        self._on_event = on_event
        self._up_or_ended = threading.Event()
        self._ended = threading.Event()
        self._failure: LippmannError = FarmFailed("the farm ended by itself")
        threading.Thread(target=self._receive, name="supervisor", daemon=True).start()

    def wait_until_up(self) -> None:
        """Wait until the service answers.

        Raises
        ------
        LippmannError
            If the farm cannot run, with the reason.
        """
        self._up_or_ended.wait()
        if not self.address.url:
            raise self._failure

    def wait(self) -> None:
        """Wait until the farm ends by itself.

        Raises
        ------
        LippmannError
            When the farm ends by itself, with the reason.
        """
        self._ended.wait()
        raise self._failure

    def stop(self) -> None:
        """Stop the farm in order; if Ctrl-C comes meanwhile, kill it."""
        try:
            self._send_stop()
            self._supervisor.wait()
        except KeyboardInterrupt:
            self._tell({"event": "killing"})
        finally:
            with suppress(BrokenPipeError):
                self._commands.close()  # The supervisor sees the end of its stdin and kills everything.
            with suppress(subprocess.TimeoutExpired):
                self._supervisor.wait(timeout=KILL_WITHIN_S)
            kill_all_below()

    def _receive(self) -> None:
        try:
            for line in self._events:
                event = json.loads(line)
                if event["event"] == "ready":
                    self.address = Address(url=event["url"], key=event["key"])
                    self._up_or_ended.set()
                elif event["event"] == "failed":
                    kind = BadInput if event["code"] == BadInput.code else FarmFailed
                    self._failure = kind(event["message"])
                else:
                    self._tell(event)
        finally:
            self._ended.set()
            self._up_or_ended.set()

    def _tell(self, event: Mapping[str, Any]) -> None:
        with suppress(OSError, ValueError):  # The listener prints, and the farm goes on where nobody reads that.
            self._on_event(event)

    def _send_stop(self) -> None:
        with suppress(BrokenPipeError):  # The supervisor has ended already.
            self._commands.write("stop\n")
            self._commands.flush()


@contextmanager
def running_farm(plan: FarmPlan, *, on_event: Listener = lambda event: None) -> Iterator[Farm]:
    """Run a one-machine farm while the context lasts.

    The calling process must have no other children, because at the end every process below it is killed.
    """
    adopt_orphans()
    command = [sys.executable, "-P", "-m", "lippmann.farm.supervisor", plan.to_json()]
    # The supervisor has a session of its own, so that Ctrl-C reaches only this process, which stops the farm in order.
    supervisor = subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, start_new_session=True
    )
    farm = Farm(supervisor, on_event)
    try:
        farm.wait_until_up()
        yield farm
    finally:
        farm.stop()
