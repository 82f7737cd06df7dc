"""Network namespaces for processes, as on hosts of their own, with links that a test cuts, slows and silences.

Each host and this machine have a TUN device on one network, and a thread carries the packets between them. TCP is the
kernel's own: what is lost here is sent again there. See `tests.network_device` for what it needs of the machine.

pass_on         packets travel in both directions, and the link is up
lose            packets of both directions or of one disappear, all or every few; nobody learns of it
delay           packets travel later by a number of seconds
throttle        packets travel later, and only so many bytes a second
down            the interface in the namespace is down: no route leads out of it
change_address  the host has another address: existing connections stay open and silent, new ones work

With `peer`, a fault is between a host and that one alone.
"""

from __future__ import annotations

import heapq
import os
import selectors
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from itertools import count, cycle

from tests.network_device import Device, new_namespace
from tests.network_quiet import changing_network
from tests.tcp_proxy import BOTH, Direction
from tests.waiting import ENOUGH_S

LARGEST_PACKET = 65_536
AT_ONCE = 64
"""The number of packets of one device that are carried before those of the others."""
BACKLOG_S = 1.0
"""A throttled way loses the packets that would wait longer, as a router does whose buffer is full."""
_VERSION_4 = 4
_DESTINATION = slice(16, 20)
"""The address of the destination in a packet of IPv4."""

End = int | None
"""The descriptor of the device of a host; None is any host."""


@dataclass
class _Fault:
    """What happens to the packets of one way."""

    lost_every: int = 0
    delay_s: float = 0.0
    bytes_per_s: float = 0.0
    """Zero is without a limit."""
    free_s: float = 0.0
    """The time at which a throttled way has sent what it has."""

    def arrival_s(self, number: int, size: int, now_s: float) -> float | None:
        """Return when a packet arrives; None if it is lost."""
        if self.lost_every and number % self.lost_every == 0:
            return None
        if self.bytes_per_s:
            begin_s = max(self.free_s, now_s)
            if begin_s - now_s > BACKLOG_S:
                return None
            now_s = self.free_s = begin_s + size / self.bytes_per_s
        return now_s + self.delay_s


class NetworkHost:
    """A network namespace on a network.

    `address` is its own address, and `here` that of this machine. `inside` runs the command after it in the namespace.
    """

    def __init__(self, network: Network, address: str) -> None:
        self.network = network
        self.address = address
        self.here = network.here
        self.device, self._namespace = new_namespace(address)
        self.inside = ("nsenter", f"--net=/proc/{os.getpid()}/fd/{self._namespace}")

    def pass_on(self) -> None:
        """Let packets travel again."""
        self.device.set_up(up=True)
        self.network.forget_faults(self.device.fd)

    def lose(self, *directions: Direction, every: int = 1, peer: NetworkHost | None = None) -> None:
        """Lose every packet of both directions or of one, or every third and so on."""
        self._set(_Fault(lost_every=every), directions, peer)

    def delay(self, seconds: float) -> None:
        """Deliver packets later."""
        self._set(_Fault(delay_s=seconds), BOTH, None)

    def throttle(self, *, delay_s: float, bits_per_s: float, peer: NetworkHost | None = None) -> None:
        """Deliver packets later, and only so many bits a second in each direction."""
        self._set(_Fault(delay_s=delay_s, bytes_per_s=bits_per_s / 8), BOTH, peer)

    def down(self) -> None:
        """Take the interface in the namespace down."""
        self.device.set_up(up=False)

    def change_address(self) -> None:
        """Give the host another address in the place of the one that it has."""
        self.address = self.network.new_address(self.device.fd)
        self.device.set_address(self.address)

    def close(self) -> None:
        self.device.close()
        os.close(self._namespace)

    def _set(self, fault: _Fault, directions: tuple[Direction, ...], peer: NetworkHost | None) -> None:
        own, other = self.device.fd, peer.device.fd if peer else None
        for direction in directions or BOTH:
            way = (own, other) if direction == "requests" else (other, own)
            self.network.set_fault(way, _Fault(fault.lost_every, fault.delay_s, fault.bytes_per_s))


class Network:
    """A network of this machine and of hosts in namespaces.

    `here` is the address of this machine. `interface` is the index of its device, which the kernel gives only once.
    """

    def __init__(self, hosts: int = 1) -> None:
        with changing_network():
            self._near = Device("lippmann%d")
        self.interface = socket.if_nametoindex(self._near.name)
        # The kernel numbers the devices of all test runs. 198.18.0.0/15 is for tests of networks (RFC 2544).
        number = int(self._near.name.removeprefix("lippmann"))
        self._addresses = (f"198.{18 + number // 256}.{number % 256}.{last}" for last in cycle(range(1, 255)))
        self._ends: dict[bytes, int] = {}
        """The descriptors of devices by address."""
        self._faults: dict[tuple[End, End], _Fault] = {}
        self.here = self.new_address(self._near.fd)
        with changing_network():
            self._near.set_address(self.here)
            self._near.set_up(up=True)
        self.hosts: list[NetworkHost] = []
        try:
            for _ in range(hosts):
                self._add_host()
        except OSError:
            self._close_devices()
            raise
        self._wake, self._waker = socket.socketpair()
        self._thread = threading.Thread(target=self._carry, name="network", daemon=True)
        self._thread.start()

    def new_address(self, end: int) -> str:
        """Return an address that nobody has, and carry its packets to a device."""
        address = next(address for address in self._addresses if socket.inet_aton(address) not in self._ends)
        others = {known: other for known, other in self._ends.items() if other != end}
        self._ends = {**others, socket.inet_aton(address): end}
        return address

    def set_fault(self, way: tuple[End, End], fault: _Fault) -> None:
        """Treat the packets of a way, from one end to another, in this way from now on."""
        self._faults = {**self._faults, way: fault}

    def forget_faults(self, end: int) -> None:
        """Let the packets of a host travel again."""
        self._faults = {way: fault for way, fault in self._faults.items() if end not in way}

    def close(self) -> None:
        """End the links; a namespace ends with the last process in it."""
        self._waker.close()
        self._thread.join(ENOUGH_S)
        self._wake.close()
        self._close_devices()

    def _add_host(self) -> None:
        address = next(self._addresses)
        host = NetworkHost(self, address)
        self.hosts.append(host)
        self._ends[socket.inet_aton(address)] = host.device.fd

    def _close_devices(self) -> None:
        with changing_network():
            self._near.close()
        for host in self.hosts:
            host.close()

    def _carry(self) -> None:
        """Carry packets until the end."""
        numbers = count()
        travelling: list[tuple[float, int, int, bytes]] = []
        with selectors.DefaultSelector() as selector:
            wake = self._wake.fileno()
            for readable in (self._near.fd, *(host.device.fd for host in self.hosts), wake):
                selector.register(readable, selectors.EVENT_READ)
            while True:
                wait_s = max(0.0, travelling[0][0] - time.monotonic()) if travelling else None
                for key, _ in selector.select(wait_s):
                    if key.fd == wake:
                        return
                    for packet in _packets(key.fd):
                        number, to = next(numbers), self._ends.get(packet[_DESTINATION])
                        if to is None or packet[0] >> 4 != _VERSION_4:
                            continue
                        arrival_s = self._fault(key.fd, to).arrival_s(number, len(packet), time.monotonic())
                        if arrival_s is not None:
                            heapq.heappush(travelling, (arrival_s, number, to, packet))
                while travelling and travelling[0][0] <= time.monotonic():
                    _, _, to, packet = heapq.heappop(travelling)
                    with suppress(OSError):  # The interface is down.
                        os.write(to, packet)

    def _fault(self, sender: int, receiver: int) -> _Fault:
        faults = self._faults
        for way in ((sender, receiver), (sender, None), (None, receiver)):
            if way in faults:
                return faults[way]
        return _NONE


_NONE = _Fault()


def _packets(end: int) -> Iterator[bytes]:
    for _ in range(AT_ONCE):
        try:
            yield os.read(end, LARGEST_PACKET)
        except OSError:  # There is no other one.
            return


@contextmanager
def network_hosts(number: int) -> Iterator[list[NetworkHost]]:
    """Lend network namespaces on one network."""
    network = Network(number)
    try:
        yield network.hosts
    finally:
        network.close()


@contextmanager
def network_host() -> Iterator[NetworkHost]:
    """Lend a network namespace with a link to it."""
    with network_hosts(1) as (host,):
        yield host


def why_no_network_host() -> str | None:
    """Return the reason why this machine lends no network namespace; None if it does."""
    try:
        with network_host():
            return None
    except OSError as error:
        what = "root" if os.geteuid() else "network namespaces and TUN devices"
        return f"needs {what}: {error}"
