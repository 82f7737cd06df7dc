"""Starts the children in order, starts them anew, ends them. One thread, one loop; nothing is polled."""

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


class Wish(IntEnum):
    """How those outside want the farm."""

    RUN = 0
    STOP = 1
    """In order."""
    HURRY = 2
    """Now."""


def tell(kind: str, **fields: Any) -> None:
    """Say something to whoever started the keeper: one JSON object a line."""
    try:
        print(json.dumps({"event": kind, **fields}), flush=True)
    except BrokenPipeError:
        return  # nobody listens any more; stdin says so too


class Keeper:
    """Keeps children alive until it is told to stop, or one of them dies again and again."""

    def __init__(
        self, children: Sequence[Child], *, tell: Callable[..., None] = tell, stdin: int | None = None
    ) -> None:
        self._children = tuple(children)
        self._tell = tell
        self._wish = Wish.RUN
        self._selector = selectors.DefaultSelector()
        self._speaking: dict[str, int] = {}
        self._stdin = sys.stdin.fileno() if stdin is None else stdin
        self._wake_read, self._wake_write = os.pipe2(os.O_NONBLOCK | os.O_CLOEXEC)

    def run(self, *, needed: Sequence[str], when_ready: Callable[[], None]) -> None:
        """Keep the farm until it is told to stop.

        Parameters
        ----------
        needed
            Children that must work before `when_ready` is called; each is started when the one before it works.

        Raises
        ------
        FarmFailed
            If a child does not come up, or dies again and again: with its last words.
        """
        self._listen()
        try:
            for child in self._children:
                self._bring_up(child, wait=child.plan.name in needed)
            if self._wish is Wish.RUN:
                when_ready()
                self._pump(lambda: False)
        finally:
            self._end()

    def _listen(self) -> None:
        os.set_blocking(self._stdin, False)
        self._selector.register(self._stdin, selectors.EVENT_READ, self._on_word)
        self._selector.register(self._wake_read, selectors.EVENT_READ, self._on_signal)
        signal.set_wakeup_fd(self._wake_write, warn_on_full_buffer=False)
        signal.signal(signal.SIGCHLD, lambda *_: None)
        signal.signal(signal.SIGTERM, lambda *_: self._wishes(Wish.STOP))
        signal.signal(signal.SIGINT, lambda *_: self._wishes(Wish.STOP))
        signal.signal(signal.SIGHUP, lambda *_: self._wishes(Wish.STOP))

    def _bring_up(self, child: Child, *, wait: bool) -> None:
        if self._wish is not Wish.RUN:
            return
        self._start(child)
        if wait and not self._pump(lambda: child.ready or not child.alive, within_s=child.plan.start_within_s):
            return
        if wait and not child.ready:
            why = f"nothing for {child.plan.start_within_s:g} s" if child.alive else "its end"
            raise FarmFailed(f"expected {child.plan.name} to come up, got {why}. Its last words:\n{child.last_words()}")

    def _start(self, child: Child) -> None:
        descriptor = child.start(time.monotonic())
        self._selector.register(descriptor, selectors.EVENT_READ, lambda: self._on_output(child, descriptor))
        self._speaking[child.plan.name] = descriptor

    def _pump(self, until: Callable[[], bool], *, within_s: float | None = None, wish: Wish = Wish.RUN) -> bool:
        """Handle what happens until something is so, time is over, or more than `wish` is wished: then False."""
        end_s = None if within_s is None else time.monotonic() + within_s
        while not until():
            if self._wish > wish:
                return False
            now_s = time.monotonic()
            if end_s is not None and now_s >= end_s:
                return True
            dues = [child.restart_at_s for child in self._children if child.restart_at_s and wish is Wish.RUN]
            next_s = min((at_s for at_s in (end_s, *dues) if at_s is not None), default=None)
            for key, _ in self._selector.select(None if next_s is None else max(0.0, next_s - now_s)):
                key.data()
            self._bury(restart=wish is Wish.RUN)
            if wish is Wish.RUN:
                self._restart_due()
        return True

    def _bury(self, *, restart: bool) -> None:
        """Reap every process that ended: children of ours, and orphans that came to us."""
        while pid := _ended_child():
            child = next((one for one in self._children if one.process is not None and one.process.pid == pid), None)
            if child is None:
                os.waitpid(pid, os.WNOHANG)
                continue
            self._hear_out(child)
            was_ready = child.ready
            code = child.bury(time.monotonic())
            kill(self._strays())
            if restart and (was_ready or child.quick_deaths > 1):
                self._tell("died", child=child.plan.name, code=code, pause_s=child.pause_s)
            if restart and child.quick_deaths > MAX_QUICK_DEATHS:
                raise FarmFailed(
                    f"expected {child.plan.name} to keep running, got {child.quick_deaths} quick ends "
                    f"(the last with {code}). Its last words:\n{child.last_words()}"
                )

    def _strays(self) -> set[int]:
        """Return what was left by children that ended: it came to us, or stands below what came to us."""
        # All of them first: what a living child starts meanwhile is then no stray.
        everything = descendants(os.getpid())
        own = {child.process.pid for child in self._children if child.process is not None}
        return everything - own.union(*(descendants(pid) for pid in own))

    def _restart_due(self) -> None:
        now_s = time.monotonic()
        for child in self._children:
            if child.restart_at_s is not None and child.restart_at_s <= now_s:
                self._start(child)
                self._tell("restarted", child=child.plan.name)

    def _end(self) -> None:
        """End the children, last first, each in its own time; then whatever is left."""
        try:
            for child in reversed(self._children):
                self._end_one(child)
        finally:
            kill_all_below()

    def _end_one(self, child: Child) -> None:
        if child.process is None or self._wish is Wish.HURRY:
            return
        self._tell("stopping", child=child.plan.name)
        child.ask_to_end()
        self._pump(lambda: not child.alive, within_s=child.plan.grace_s, wish=Wish.STOP)
        if child.process is not None:
            kill({child.process.pid} | descendants(child.process.pid))

    def _on_word(self) -> None:
        try:
            words = os.read(self._stdin, _CHUNK)
        except BlockingIOError:
            return
        if not words:  # whoever started us is gone
            self._selector.unregister(self._stdin)
            self._wishes(Wish.HURRY)
        elif b"stop" in words:
            self._wishes(Wish.STOP)

    def _on_signal(self) -> None:
        os.read(self._wake_read, _CHUNK)

    def _on_output(self, child: Child, descriptor: int) -> bool:
        """Take what a child says; return whether there may be more."""
        try:
            data = os.read(descriptor, _CHUNK)
        except BlockingIOError:
            return False
        if not data:
            self._selector.unregister(descriptor)
            self._speaking = {name: one for name, one in self._speaking.items() if one != descriptor}
            os.close(descriptor)
        elif child.hear(data):
            self._tell("working", child=child.plan.name)
        return bool(data)

    def _hear_out(self, child: Child) -> None:
        """Take the last words of a child that ended."""
        descriptor = self._speaking.get(child.plan.name)
        while descriptor is not None and self._on_output(child, descriptor):
            pass

    def _wishes(self, wish: Wish) -> None:
        self._wish = max(self._wish, wish)


def _ended_child() -> int | None:
    try:
        found = os.waitid(os.P_ALL, 0, os.WEXITED | os.WNOHANG | os.WNOWAIT)
    except ChildProcessError:
        return None
    return found.si_pid if found else None
