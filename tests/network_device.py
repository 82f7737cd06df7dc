"""TUN devices, and network namespaces with one each: what `tests.network_host` makes its networks of.

Few kernels have netem and nftables, and not every machine has iproute2. This needs neither, but it needs root. The
kernel removes a TUN device with its last descriptor, and a namespace with its last process, so nothing stays when this
process ends, however it ends.
"""

from __future__ import annotations

import ctypes
import fcntl
import os
import socket
import struct
from concurrent.futures import ThreadPoolExecutor

_CLONE_NEWNET = 0x4000_0000
_TUNSETIFF, _IFF_TUN, _IFF_NO_PI = 0x4004_54CA, 0x0001, 0x1000
_SIOCGIFFLAGS, _SIOCSIFFLAGS, _SIOCSIFADDR, _SIOCSIFNETMASK = 0x8913, 0x8914, 0x8916, 0x891C
_IFF_UP = 0x0001


class Device:
    """A TUN device in the network namespace of the calling thread."""

    def __init__(self, name: str) -> None:
        self.fd = os.open("/dev/net/tun", os.O_RDWR | os.O_NONBLOCK)
        made = fcntl.ioctl(self.fd, _TUNSETIFF, struct.pack("16sH22x", name.encode(), _IFF_TUN | _IFF_NO_PI))
        self.name = made[:16].rstrip(b"\0").decode()
        self._control = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)  # It stays in this namespace.

    def set_address(self, address: str) -> None:
        """Give the device this address alone, in a network of 256."""
        for request, value in ((_SIOCSIFADDR, address), (_SIOCSIFNETMASK, "255.255.255.0")):
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


def new_namespace(address: str) -> tuple[Device, int]:
    """Make a network namespace; return its device, which has the address, and a descriptor that keeps it."""
    with ThreadPoolExecutor(1) as thread:  # A thread of its own, which alone moves into the namespace.
        return thread.submit(_move_into_namespace, address).result()


def _move_into_namespace(address: str) -> tuple[Device, int]:
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.unshare(_CLONE_NEWNET):
        raise OSError(ctypes.get_errno(), "unshare: " + os.strerror(ctypes.get_errno()))
    device = Device("link0")
    device.set_up(up=True, name="lo")
    device.set_address(address)
    device.set_up(up=True)
    return device, os.open("/proc/thread-self/ns/net", os.O_RDONLY)
