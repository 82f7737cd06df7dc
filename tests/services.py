"""Several processes of the service, a client that goes to any of them, and a reader of events that follows them."""

from __future__ import annotations

import itertools
import signal
import subprocess
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx

from lippmann.client.stream import parse_events
from tests.broker import free_port
from tests.farm import LIPPMANN
from tests.waiting import ENOUGH_S, halt, until

ANSWER_S = 2.0
"""The time after which a load balancer asks another service."""
AWAY_S = 5.0
"""The time for which it then leaves a service alone."""
PAUSE_S = 0.02
"""The pause between two requests of the traffic, so that tests have the cores too."""


class ServiceProcess:
    """A process of the service, which can be stopped, continued, killed and started again at its address."""

    def __init__(self, name: str, env: Mapping[str, str], folder: Path) -> None:
        self.name, self.env, self.port = name, dict(env), free_port()
        self.log, self.key_file = folder / f"{name}.log", folder / "admin.key"
        self.url = f"http://127.0.0.1:{self.port}"
        self.process: subprocess.Popen[bytes] | None = None

    def start(self, command: Sequence[str] = (LIPPMANN,)) -> None:
        """Start the process, and return once it answers."""
        line = [*command, "serve", "--port", str(self.port), "--key-file", str(self.key_file)]
        with self.log.open("ab") as log:
            self.process = subprocess.Popen(line, env=self.env, stdout=log, stderr=subprocess.STDOUT)
        until(self._answers)

    @property
    def pid(self) -> int:
        assert self.process is not None
        return self.process.pid

    def end(self, number: signal.Signals = signal.SIGTERM) -> None:
        """End the process by a signal, unless it has ended."""
        if self.process is not None and self.process.poll() is None:
            self.process.send_signal(signal.SIGCONT)
            self.process.send_signal(number)
            self.process.wait(ENOUGH_S)

    def halt(self) -> None:
        halt(self.pid)

    def go_on(self) -> None:
        assert self.process is not None
        self.process.send_signal(signal.SIGCONT)

    def _answers(self) -> bool:
        assert self.process is not None
        assert self.process.poll() is None, f"{self.name} ended: {self.log.read_text()[-2000:]}"
        try:
            return httpx.get(f"{self.url}/api/v1/health").is_success
        except httpx.TransportError:
            return False


class Balancer:
    """A client that asks the services in turn, and the next one if one does not answer, as a load balancer does."""

    def __init__(self, urls: Sequence[str], key: str) -> None:
        self._turns = itertools.cycle(urls)
        self._away_until_s = dict.fromkeys(urls, 0.0)
        headers = {"Authorization": f"Bearer {key}"}
        self._client = httpx.Client(headers=headers, timeout=httpx.Timeout(ANSWER_S))

    def request(self, method: str, path: str, **options: Any) -> httpx.Response:
        """Return the first answer of a service that is there and has its database."""
        end_s = time.monotonic() + ENOUGH_S
        while time.monotonic() < end_s:
            url = next(self._turns)
            if self._away_until_s[url] > time.monotonic() and min(self._away_until_s.values()) < time.monotonic():
                continue
            try:
                answer = self._client.request(method, f"{url}/api/v1{path}", **options)
            except httpx.TransportError:
                self._away_until_s[url] = time.monotonic() + AWAY_S
                continue
            if answer.status_code != httpx.codes.SERVICE_UNAVAILABLE:
                answer.raise_for_status()
                return answer
            self._away_until_s[url] = time.monotonic() + AWAY_S
            time.sleep(PAUSE_S)
        raise AssertionError(f"no service has answered {method} {path} within {ENOUGH_S} s")

    def get(self, path: str) -> Any:
        """Return what the answer to a GET request holds."""
        return self.request("GET", path).json()

    def close(self) -> None:
        self._client.close()


@dataclass
class Traffic:
    """Requests that are sent one after the other, all the time."""

    requests: int = 0
    error: BaseException | None = None
    longest_s: float = 0.0
    """The longest time until one was answered."""


@contextmanager
def traffic(balancer: Balancer, paths: Sequence[str]) -> Iterator[Traffic]:
    """Send requests while the context lasts; all of them are answered, or it fails."""
    sent, stopping = Traffic(), threading.Event()

    def send() -> None:
        try:
            for path in itertools.cycle(paths):
                if stopping.is_set():
                    return
                begun_s = time.monotonic()
                balancer.get(path)
                sent.requests += 1
                sent.longest_s = max(sent.longest_s, time.monotonic() - begun_s)
                time.sleep(PAUSE_S)
        except BaseException as error:  # raised in the thread of the test, below
            sent.error = error

    thread = threading.Thread(target=send, daemon=True)
    thread.start()
    yield sent
    stopping.set()
    thread.join(ENOUGH_S)
    if sent.error is not None:
        raise sent.error


class EventReader:
    """Reads all events of the farm, from the first one; when a stream ends, it goes on with the next service."""

    def __init__(self, urls: Sequence[str], key: str) -> None:
        self.ids: list[int] = []
        self._turns, self._key = itertools.cycle(urls), key
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._read_always, daemon=True)
        self._thread.start()

    def stop(self) -> None:
        self._stopping.set()
        self._thread.join(ENOUGH_S)

    def _read_always(self) -> None:
        while not self._stopping.is_set():
            headers = {"Authorization": f"Bearer {self._key}", "Last-Event-ID": str(self.ids[-1] if self.ids else 0)}
            try:
                # Comments come more often than this.
                with httpx.stream(
                    "GET", f"{next(self._turns)}/api/v1/events", headers=headers, timeout=ANSWER_S
                ) as got:
                    got.raise_for_status()
                    self._read(got)
            except httpx.HTTPError:
                continue

    def _read(self, answer: httpx.Response) -> None:
        # Comments come all the time, so a reader that is told to stop soon does.
        lines = itertools.takewhile(lambda _: not self._stopping.is_set(), answer.iter_lines())
        for event in parse_events(lines):
            if event.id:
                self.ids.append(int(event.id))
