"""The supervisor starts the children in order, restarts them and stops them, in one thread and one event loop."""

from __future__ import annotations

import json
import os
import selectors
import signal
import sys
import time
from collections.abc import Callable, Sequence
from enum import IntEnum
from typing import Any

from lippmann.errors import FarmFailed
from lippmann.farm.supervisor.child import MAX_QUICK_DEATHS, Child
from lippmann.farm.supervisor.descendants import descendants, kill, kill_all_below

_CHUNK = 65_536


class Command(IntEnum):
    """A command to the supervisor; a higher command overrides a lower one."""

    RUN = 0
    STOP = 1
    """Stop the children in order, each within its grace period."""
    KILL = 2
    """Kill the children now."""


def send_event(kind: str, **fields: Any) -> None:
    """Send an event to the process that started the supervisor: one JSON object per line."""
    try:
        print(json.dumps({"event": kind, **fields}), flush=True)
    except BrokenPipeError:
        return  # The reader is gone; the end of stdin then stops the supervisor.


class Supervisor:
    """Keeps children running until it is told to stop, or one of them dies repeatedly."""

    def __init__(
        self, children: Sequence[Child], *, send_event: Callable[..., None] = send_event, stdin: int | None = None
    ) -> None:
        self._children = tuple(children)
        self._send_event = send_event
        self._command = Command.RUN
        self._selector = selectors.DefaultSelector()
        self._outputs: dict[str, int] = {}
        """The descriptors of the output of each child, by its name."""
        self._stdin = sys.stdin.fileno() if stdin is None else stdin
        self._wake_read, self._wake_write = os.pipe2(os.O_NONBLOCK | os.O_CLOEXEC)

    def run(self, *, needed: Sequence[str], when_ready: Callable[[], None]) -> None:
        """Run the farm until it is told to stop.

        Parameters
        ----------
        needed
            The children that must be ready before `when_ready` is called. Each of them is started when the one before
            it is ready.

        Raises
        ------
        FarmFailed
            If a child does not start, or dies repeatedly, with the last lines of its output.
        """
        self._register()
        try:
            for child in self._children:
                self._start_and_wait(child, wait=child.plan.name in needed)
            if self._command is Command.RUN:
                when_ready()
                self._handle_events(lambda: False)
        finally:
            self._stop()

    def _register(self) -> None:
        os.set_blocking(self._stdin, False)
        self._selector.register(self._stdin, selectors.EVENT_READ, self._on_stdin)
        self._selector.register(self._wake_read, selectors.EVENT_READ, self._on_signal)
        signal.set_wakeup_fd(self._wake_write, warn_on_full_buffer=False)
        signal.signal(signal.SIGCHLD, lambda *_: None)
        signal.signal(signal.SIGTERM, lambda *_: self._obey(Command.STOP))
        signal.signal(signal.SIGINT, lambda *_: self._obey(Command.STOP))
        signal.signal(signal.SIGHUP, lambda *_: self._obey(Command.STOP))

    def _start_and_wait(self, child: Child, *, wait: bool) -> None:
        if self._command is not Command.RUN:
            return
        self._start(child)
        within_s = child.plan.start_within_s
        if wait and not self._handle_events(lambda: child.ready or not child.alive, within_s=within_s):
            return
        if wait and not child.ready:
            got = f"no answer for {within_s:g} s" if child.alive else "its end"
            raise FarmFailed(f"expected {child.plan.name} to start, got {got}. Its last output:\n{child.last_lines()}")

    def _start(self, child: Child) -> None:
        descriptor = child.start(time.monotonic())
        self._selector.register(descriptor, selectors.EVENT_READ, lambda: self._on_output(child, descriptor))
        self._outputs[child.plan.name] = descriptor

    def _handle_events(
        self, until: Callable[[], bool], *, within_s: float | None = None, command: Command = Command.RUN
    ) -> bool:
        """Handle events until a condition holds or time is over; return False if a higher command arrives first."""
        end_s = None if within_s is None else time.monotonic() + within_s
        while not until():
            if self._command > command:
                return False
            now_s = time.monotonic()
            if end_s is not None and now_s >= end_s:
                return True
            restarts = [child.restart_at_s for child in self._children if child.restart_at_s and command is Command.RUN]
            next_s = min((at_s for at_s in (end_s, *restarts) if at_s is not None), default=None)
            for key, _ in self._selector.select(None if next_s is None else max(0.0, next_s - now_s)):
                key.data()
            self._reap(restart=command is Command.RUN)
            if command is Command.RUN:
                self._restart_due()
        return True

    def _reap(self, *, restart: bool) -> None:
        """Reap every process that has ended: children, and orphans that the supervisor adopted."""
        while pid := _ended_child():
            child = next((one for one in self._children if one.process is not None and one.process.pid == pid), None)
            if child is None:
                os.waitpid(pid, os.WNOHANG)
                continue
            self._drain(child)
            was_ready = child.ready
            code = child.reap(time.monotonic())
            kill(self._orphans())
            if restart and (was_ready or child.quick_deaths > 1):
                self._send_event("died", child=child.plan.name, code=code, pause_s=child.pause_s)
            if restart and child.quick_deaths > MAX_QUICK_DEATHS:
                raise FarmFailed(
                    f"expected {child.plan.name} to keep running, got {child.quick_deaths} quick ends "
                    f"(the last with {code}). Its last output:\n{child.last_lines()}"
                )

    def _orphans(self) -> set[int]:
        """Return the processes that ended children left: the supervisor adopted them, or they are below such a one."""
        # All descendants are listed first, so that what a living child starts meanwhile is not taken for an orphan.
        everything = descendants(os.getpid())
        own = {child.process.pid for child in self._children if child.process is not None}
        return everything - own.union(*(descendants(pid) for pid in own))

    def _restart_due(self) -> None:
        now_s = time.monotonic()
        for child in self._children:
            if child.restart_at_s is not None and child.restart_at_s <= now_s:
                self._start(child)
                self._send_event("restarted", child=child.plan.name)

    def _stop(self) -> None:
        """Stop the children, last first, each within its grace period, and then kill whatever is left."""
        try:
            for child in reversed(self._children):
                self._stop_one(child)
        finally:
            kill_all_below()

    def _stop_one(self, child: Child) -> None:
        if child.process is None or self._command is Command.KILL:
            return
        self._send_event("stopping", child=child.plan.name)
        child.terminate()
        self._handle_events(lambda: not child.alive, within_s=child.plan.grace_s, command=Command.STOP)
        if child.process is not None:
            kill({child.process.pid} | descendants(child.process.pid))

    def _on_stdin(self) -> None:
        try:
            text = os.read(self._stdin, _CHUNK)
        except BlockingIOError:
            return
        if not text:  # The process that started the supervisor is gone.
            self._selector.unregister(self._stdin)
            self._obey(Command.KILL)
        elif b"stop" in text:
            self._obey(Command.STOP)

    def _on_signal(self) -> None:
        os.read(self._wake_read, _CHUNK)

    def _on_output(self, child: Child, descriptor: int) -> bool:
        """Read output of a child; return whether there may be more."""
        try:
            data = os.read(descriptor, _CHUNK)
        except BlockingIOError:
            return False
        if not data:
            self._selector.unregister(descriptor)
            self._outputs = {name: one for name, one in self._outputs.items() if one != descriptor}
            os.close(descriptor)
        elif child.receive(data):
            self._send_event("child_ready", child=child.plan.name)
        return bool(data)

    def _drain(self, child: Child) -> None:
        """Read the remaining output of a child that has ended."""
        descriptor = self._outputs.get(child.plan.name)
        while descriptor is not None and self._on_output(child, descriptor):
            pass

    def _obey(self, command: Command) -> None:
        self._command = max(self._command, command)


def _ended_child() -> int | None:
    try:
        found = os.waitid(os.P_ALL, 0, os.WEXITED | os.WNOHANG | os.WNOWAIT)
    except ChildProcessError:
        return None
    return found.si_pid if found else None
