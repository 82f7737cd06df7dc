"""A real broker for tests: a Valkey child on loopback that can be wiped, frozen and killed."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
from pathlib import Path
from typing import Any

import redis

from lippmann.farm.supervisor.broker import find_server
from lippmann.farm.supervisor.descendants import dying_with
from tests.waiting import ENOUGH_S, until


class Broker:
    """A valkey-server child on a loopback port, which can be wiped, stopped and killed."""

    def __init__(self, folder: Path) -> None:
        self.port = free_port()
        self.url = f"redis://127.0.0.1:{self.port}/0"
        self.unix_url = f"unix://{folder}/broker.sock"
        self._on_socket = ["--unixsocket", "broker.sock"]
        self._folder = folder
        self.start()

    def start(self) -> None:
        command = [str(find_server()), "--port", str(self.port), "--bind", "127.0.0.1", "--save", "", *self._on_socket]
        # Valkey overwrites its environment, so `tests.leftovers` would not know it.
        die = dying_with(os.getpid())
        self.process = subprocess.Popen(command, stdout=subprocess.DEVNULL, cwd=self._folder, preexec_fn=die)
        until(self._answers)

    @property
    def client(self) -> Any:
        return redis.Redis.from_url(self.url, protocol=2, socket_timeout=ENOUGH_S)

    def freeze(self) -> None:
        self.process.send_signal(signal.SIGSTOP)

    def thaw(self) -> None:
        self.process.send_signal(signal.SIGCONT)

    def kill(self) -> None:
        self.process.kill()
        self.process.wait()

    def _answers(self) -> bool:
        try:
            return bool(self.client.ping())
        except redis.RedisError:
            return False


def free_port() -> int:
    """Return a loopback port that nobody listens on now."""
    with socket.socket() as sock:
        sock.bind(("127.0.0.1", 0))
        port: int = sock.getsockname()[1]
        return port
