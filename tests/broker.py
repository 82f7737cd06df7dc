"""A real broker for tests: a Valkey child on loopback that can be wiped, frozen and killed."""

from __future__ import annotations

import itertools
import os
import random
import signal
import socket
import subprocess
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import redis

from lippmann.farm.supervisor.broker import find_server
from lippmann.farm.supervisor.descendants import dying_with
from tests.network_host import NetworkHost
from tests.waiting import ENOUGH_S, halt, until

_PORTS = range(20_000, 32_000)
"""Below the ports that the kernel gives to outgoing connections (net.ipv4.ip_local_port_range)."""
_claims: list[socket.socket] = []


class Broker:
    """A valkey-server child on a loopback port, which can be wiped, stopped and killed.

    With `addresses` it listens there too, for processes in network namespaces of this machine. With `host` it is in
    that namespace itself, and listens on its address.
    """

    def __init__(
        self, folder: Path, *, keeps_data: bool = False, addresses: Sequence[str] = (), host: NetworkHost | None = None
    ) -> None:
        self._addresses = [host.address] if host else addresses
        self._inside = host.inside if host else ()
        self._saving = ["--appendonly", "yes", "--appendfsync", "always"] if keeps_data else []
        self.port = free_port()
        self.url = f"redis://{host.address if host else '127.0.0.1'}:{self.port}/0"
        self.unix_url = f"unix://{folder}/broker.sock"
        self._on_socket = ["--unixsocket", "broker.sock"]
        self._folder = folder
        self.start()

    def start(self) -> None:
        command = [*self._inside, str(find_server()), "--port", str(self.port), "--save", ""]
        command += ["--bind", "127.0.0.1", *self._addresses]
        command += [*self._on_socket, *self._saving]
        if self._addresses:  # Otherwise it answers loopback alone, as it has no password.
            command += ["--protected-mode", "no"]
        # Valkey overwrites its environment, so `tests.leftovers` would not know it.
        die = dying_with(os.getpid())
        self.process = subprocess.Popen(command, stdout=subprocess.DEVNULL, cwd=self._folder, preexec_fn=die)
        until(self._answers)

    @property
    def client(self) -> Any:
        return redis.Redis.from_url(self.url, protocol=2, socket_timeout=ENOUGH_S)

    def freeze(self) -> None:
        halt(self.process.pid)

    def thaw(self) -> None:
        self.process.send_signal(signal.SIGCONT)

    def kill(self) -> None:
        self.process.kill()
        self.process.wait()

    def _answers(self) -> bool:
        assert self.process.poll() is None, f"the broker on port {self.port} ended with {self.process.returncode}"
        try:
            return bool(self.client.ping() and self.client.info("server")["process_id"] == self.process.pid)
        except redis.RedisError:
            return False


@contextmanager
def broker_with_users(users: Path, folder: Path) -> Iterator[int]:
    """Run a broker with a file of users, and yield its port on loopback."""
    port = free_port()
    command = [str(find_server()), "--port", str(port), "--bind", "127.0.0.1", "--save", "", "--aclfile", str(users)]
    die = dying_with(os.getpid())
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, cwd=folder, preexec_fn=die)
    try:
        until(lambda: _pings(port))
        yield port
    finally:
        process.kill()
        process.wait()


def _pings(port: int) -> bool:
    try:
        with redis.Redis(port=port, protocol=2) as client:
            return bool(client.execute_command("PING"))
    except redis.RedisError:
        return False


def free_port() -> int:
    """Return a loopback port on which nobody listens, and which no other test gets while this process lives.

    A port that was only free a moment ago may be given to two tests at once: then one of them uses the other's broker.
    """
    start = random.randrange(len(_PORTS))
    for port in itertools.chain(_PORTS[start:], _PORTS[:start]):
        if _claimed(port):
            with socket.socket() as sock:
                try:
                    sock.bind(("127.0.0.1", port))
                except OSError:  # A program that is no test listens there.
                    continue
                return port
    raise AssertionError("expected a free loopback port, got none")


def _claimed(port: int) -> bool:
    """Claim a port by an abstract Unix socket, which the kernel removes with this process."""
    claim = socket.socket(socket.AF_UNIX)
    try:
        claim.bind(f"\0lippmann-test-port-{port}")
    except OSError:
        claim.close()
        return False
    _claims.append(claim)
    return True
