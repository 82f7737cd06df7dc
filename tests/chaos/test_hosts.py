"""Hosts in network namespaces, and what happens to their connections when a link fails."""

from __future__ import annotations

import ctypes
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager

import pytest

from tests.network_host import NetworkHost, network_host, network_hosts, why_no_network_host
from tests.repository import ROOT
from tests.waiting import ENOUGH_S, until

pytestmark = pytest.mark.skipif(bool(reason := why_no_network_host()), reason=str(reason))

ECHO = """
import socket, sys
with socket.create_connection((sys.argv[1], int(sys.argv[2]))) as link:
    while data := link.recv(100):
        link.sendall(data)
"""
SHORT_S = 0.3
"""A time in which an answer would have come; it is too short only on a machine on which the test passes anyway."""


@contextmanager
def echo_from(host: NetworkHost) -> Iterator[socket.socket]:
    """Return a connection to a process in the namespace that sends back what it gets."""
    with socket.create_server((host.here, 0)) as server:
        command = [*host.inside, sys.executable, "-c", ECHO, host.here, str(server.getsockname()[1])]
        with subprocess.Popen(command) as process:
            try:
                server.settimeout(ENOUGH_S)
                with server.accept()[0] as connection:
                    yield connection
            finally:
                process.kill()


def comes_back(connection: socket.socket, text: bytes, *, within_s: float) -> bool:
    connection.sendall(text)
    connection.settimeout(within_s)
    try:
        return connection.recv(100) == text
    except TimeoutError:
        return False


@pytest.mark.parametrize(
    "fault", [NetworkHost.lose, lambda host: host.lose("requests"), lambda host: host.lose("answers"), NetworkHost.down,
              lambda host: host.delay(ENOUGH_S)],
    ids=["silent", "requests lost", "answers lost", "link down", "slow"],
)  # fmt: skip
def test_a_connection_is_silent_during_a_fault_and_goes_on_after_it(fault: object) -> None:
    assert callable(fault)
    with network_host() as host, echo_from(host) as connection:
        assert comes_back(connection, b"before", within_s=ENOUGH_S)
        fault(host)
        assert not comes_back(connection, b"during", within_s=SHORT_S)
        host.pass_on()
        connection.settimeout(ENOUGH_S)
        assert connection.recv(100) == b"during"


def test_another_address_leaves_old_connections_silent_and_lets_new_ones_in() -> None:
    with network_host() as host, echo_from(host) as old:
        assert comes_back(old, b"before", within_s=ENOUGH_S)
        host.change_address()
        assert not comes_back(old, b"after", within_s=SHORT_S)
        with echo_from(host) as new:
            assert comes_back(new, b"after", within_s=ENOUGH_S)


def connection(client: NetworkHost, server: NetworkHost) -> tuple[socket.socket, socket.socket]:
    """Return both ends of a connection between two hosts."""
    with socket_of(server) as listening, socket_of(client) as connecting:
        listening.bind((server.address, 0))
        listening.listen()
        listening.settimeout(ENOUGH_S)
        connecting.connect(listening.getsockname())
        return connecting.dup(), listening.accept()[0]


def socket_of(host: NetworkHost) -> socket.socket:
    """Return a socket in the namespace of a host: those of a thread that has entered it."""

    def enter() -> socket.socket:
        with open(host.inside[1].removeprefix("--net=")) as namespace:
            assert ctypes.CDLL(None).setns(namespace.fileno(), 0) == 0
        return socket.socket()

    with ThreadPoolExecutor(1) as thread:
        return thread.submit(enter).result()


def arrives(sender: socket.socket, receiver: socket.socket, *, within_s: float) -> bool:
    sender.sendall(b"hello")
    receiver.settimeout(within_s)
    try:
        return receiver.recv(5) == b"hello"
    except TimeoutError:
        return False


def test_a_fault_between_two_hosts_in_one_direction_is_no_fault_of_the_others() -> None:
    with network_hosts(3) as (one, two, three):
        here, there = connection(one, two)
        aside, third = connection(one, three)
        with here, there, aside, third:
            one.lose("requests", peer=two)
            assert not arrives(here, there, within_s=SHORT_S)
            assert arrives(there, here, within_s=ENOUGH_S)
            assert arrives(aside, third, within_s=ENOUGH_S)
            two.pass_on()
            there.settimeout(ENOUGH_S)
            assert there.recv(5) == b"hello"


def test_a_throttled_link_carries_only_so_many_bits_a_second() -> None:
    with network_hosts(2) as (one, two):
        here, there = connection(one, two)
        with here, there:
            there.settimeout(ENOUGH_S)
            one.throttle(delay_s=0.1, bits_per_s=1e6)
            begun_s = time.monotonic()
            here.sendall(bytes(50_000))
            with there.makefile("rb") as stream:
                assert stream.read(50_000) == bytes(50_000)
            assert time.monotonic() - begun_s > 0.1 + 8 * 50_000 / 1e6


def is_there(interface: int) -> bool:
    return interface in {index for index, _ in socket.if_nameindex()}


def test_nothing_stays_of_a_host_after_ctrl_c() -> None:
    found = []

    def interrupted() -> None:
        with network_host() as host:
            found.extend([host.network.interface, is_there(host.network.interface)])
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    interface, was_there = found
    assert was_there
    assert not is_there(interface)


HOST = """
import signal
from tests.network_host import network_host
with network_host() as host:
    print(host.network.interface, flush=True)
    signal.pause()
"""


def test_nothing_stays_of_a_host_when_its_process_is_killed() -> None:
    with subprocess.Popen([sys.executable, "-c", HOST], cwd=ROOT, stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        interface = int(process.stdout.readline())
        assert is_there(interface)
        process.send_signal(signal.SIGKILL)
    until(lambda: not is_there(interface))
