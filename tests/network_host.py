"""A network namespace for a process, as on a host of its own, with a link to it that a test cuts, slows and silences.

Each end of the link is a TUN device, one here and one in the namespace, and a thread carries the packets between them.
TCP is the kernel's own: what is lost here is sent again there. Few kernels have netem and nftables, and this needs
neither, but it needs root. The kernel removes a TUN device with its last descriptor, and a namespace with its last
process, so nothing stays when this process ends, however it ends.

pass_on         packets travel in both directions, and the link is up
lose            packets of both directions or of one disappear, all or every few; nobody learns of it
delay           packets travel later by a number of seconds
down            the interface in the namespace is down: no route leads out of it
change_address  the namespace has another address: existing connections stay open and silent, new ones work
"""

from __future__ import annotations

import ctypes
import fcntl
import heapq
import os
import selectors
import socket
import struct
import threading
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from itertools import count

from tests.tcp_proxy import BOTH, Direction
from tests.waiting import ENOUGH_S

_CLONE_NEWNET = 0x4000_0000
_TUNSETIFF, _IFF_TUN, _IFF_NO_PI = 0x4004_54CA, 0x0001, 0x1000
_SIOCGIFFLAGS, _SIOCSIFFLAGS, _SIOCSIFADDR, _SIOCSIFNETMASK = 0x8913, 0x8914, 0x8916, 0x891C
_IFF_UP = 0x0001

LARGEST_PACKET = 65_536


class _Interface:
    """A TUN device in the network namespace of the calling thread."""

    def __init__(self, name: str) -> None:
        self.fd = os.open("/dev/net/tun", os.O_RDWR | os.O_NONBLOCK)
        made = fcntl.ioctl(self.fd, _TUNSETIFF, struct.pack("16sH22x", name.encode(), _IFF_TUN | _IFF_NO_PI))
        self.name = made[:16].rstrip(b"\0").decode()
        self._control = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)  # It stays in this namespace.

    def set_address(self, address: str) -> None:
        """Give the device this address alone, in a network of eight."""
        for request, value in ((_SIOCSIFADDR, address), (_SIOCSIFNETMASK, "255.255.255.248")):
            self._ask(request, self.name, struct.pack("=HH4s8x", socket.AF_INET, 0, socket.inet_aton(value)))

    def set_up(self, *, up: bool, name: str | None = None) -> None:
        """Take the device, or another of its namespace, up or down."""
        name = name or self.name
        (flags,) = struct.unpack_from("H", self._ask(_SIOCGIFFLAGS, name, b""), 16)
        self._ask(_SIOCSIFFLAGS, name, struct.pack("H", flags | _IFF_UP if up else flags & ~_IFF_UP))

    def _ask(self, request: int, name: str, value: bytes) -> bytes:
        return fcntl.ioctl(self._control, request, struct.pack("16s24s", name.encode(), value))

    def close(self) -> None:
        self._control.close()
        os.close(self.fd)


class NetworkHost:
    """A network namespace with a link to this one.

    `here` is the address of this machine on the link. `inside` runs the command after it in the namespace. `interface`
    is the index of the device here, which the kernel gives only once.
    """

    def __init__(self) -> None:
        self._near = _Interface("lippmann%d")
        self.interface = socket.if_nametoindex(self._near.name)
        # The kernel numbers the devices of all test runs. 198.18.0.0/15 is for tests of networks (RFC 2544).
        number = int(self._near.name.removeprefix("lippmann"))
        network = f"198.18.{number // 32}.{{}}".format
        first = number % 32 * 8
        self.here = network(first + 1)
        self._addresses = (network(first + 2 + turn % 5) for turn in count())
        try:
            with ThreadPoolExecutor(1) as thread:  # A thread of its own, which alone moves into the namespace.
                self._far, self._namespace = thread.submit(_make_namespace, next(self._addresses)).result()
        except OSError:
            self._near.close()
            raise
        self._near.set_address(self.here)
        self._near.set_up(up=True)
        self.inside = ("nsenter", f"--net=/proc/{os.getpid()}/fd/{self._namespace}")
        self._lost: dict[Direction, int] = {}
        self._delay_s = 0.0
        self._wake, self._waker = socket.socketpair()
        self._thread = threading.Thread(target=self._carry, name="network-host", daemon=True)
        self._thread.start()

    def pass_on(self) -> None:
        """Let packets travel again."""
        self._far.set_up(up=True)
        self._lost, self._delay_s = {}, 0.0

    def lose(self, *directions: Direction, every: int = 1) -> None:
        """Lose every packet of both directions or of one, or every third and so on."""
        self._lost = dict.fromkeys(directions or BOTH, every)

    def delay(self, seconds: float) -> None:
        """Deliver packets later."""
        self._delay_s = seconds

    def down(self) -> None:
        """Take the interface in the namespace down."""
        self._far.set_up(up=False)

    def change_address(self) -> None:
        """Give the namespace another address in the place of the one that it has."""
        self._far.set_address(next(self._addresses))

    def close(self) -> None:
        """End the link; the namespace ends with the last process in it."""
        self._waker.close()
        self._thread.join(ENOUGH_S)
        self._wake.close()
        self._near.close()
        self._far.close()
        os.close(self._namespace)

    def _carry(self) -> None:
        """Carry packets until the end."""
        ways: dict[int, tuple[int, Direction]] = {
            self._near.fd: (self._far.fd, "answers"),
            self._far.fd: (self._near.fd, "requests"),
        }
        numbers = count()
        travelling: list[tuple[float, int, int, bytes]] = []
        with selectors.DefaultSelector() as selector:
            wake = self._wake.fileno()
            for readable in (*ways, wake):
                selector.register(readable, selectors.EVENT_READ)
            while True:
                wait_s = max(0.0, travelling[0][0] - time.monotonic()) if travelling else None
                for key, _ in selector.select(wait_s):
                    if key.fd == wake:
                        return
                    to, direction = ways[key.fd]
                    with suppress(OSError):  # Another packet was not there after all.
                        packet, number = os.read(key.fd, LARGEST_PACKET), next(numbers)
                        every = self._lost.get(direction)
                        if every is None or number % every:
                            heapq.heappush(travelling, (time.monotonic() + self._delay_s, number, to, packet))
                while travelling and travelling[0][0] <= time.monotonic():
                    _, _, to, packet = heapq.heappop(travelling)
                    with suppress(OSError):  # The interface is down.
                        os.write(to, packet)


def _make_namespace(address: str) -> tuple[_Interface, int]:
    """Move this thread into a new network namespace; return its device and a descriptor that keeps it."""
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.unshare(_CLONE_NEWNET):
        raise OSError(ctypes.get_errno(), "unshare: " + os.strerror(ctypes.get_errno()))
    device = _Interface("link0")
    device.set_up(up=True, name="lo")
    device.set_address(address)
    device.set_up(up=True)
    return device, os.open("/proc/thread-self/ns/net", os.O_RDONLY)


@contextmanager
def network_host() -> Iterator[NetworkHost]:
    """Lend a network namespace with a link to it."""
    host = NetworkHost()
    try:
        yield host
    finally:
        host.close()


def why_no_network_host() -> str | None:
    """Return the reason why this machine lends no network namespace; None if it does."""
    try:
        with network_host():
            return None
    except OSError as error:
        what = "root" if os.geteuid() else "network namespaces and TUN devices"
        return f"needs {what}: {error}"
