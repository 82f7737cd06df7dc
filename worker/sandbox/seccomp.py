"""The filter of system calls of everything in a sandbox: a program for the kernel's seccomp, made here.

It takes away what neither POV-Ray nor a reader of pictures needs, and what the other walls of the sandbox do not hold:
sockets of all kinds, namespaces, other processes, memory that no limit counts, links and devices left behind, and the
parts of the kernel in which most faults are found. Calls that are newer than this table do not exist inside.

The format is that of linux/filter.h and linux/seccomp.h. This module imports nothing but the standard library.
"""

from __future__ import annotations

import errno
import os
import platform
import struct
from functools import lru_cache

from lippmann.errors import SandboxMissing

_AUDIT_ARCH = {"x86_64": 0xC000003E, "aarch64": 0xC00000B7}
_COLUMN = {"x86_64": 0, "aarch64": 1}
_X32_BIT = 0x40000000
_NEWEST = 450
"""set_mempolicy_home_node of Linux 5.17, the newest call of the table's headers."""

_ALLOW, _KILL, _ERRNO = 0x7FFF0000, 0x80000000, 0x00050000
_LOAD, _EQUAL, _GREATER, _ANY_BIT, _RETURN = 0x20, 0x15, 0x25, 0x45, 0x06
_NR, _ARCH = 0, 4

_CLONE_NAMESPACES = 0x7E020000
_CLONE_THREAD = 0x00010000
_MAP_SHARED, _MAP_ANONYMOUS = 0x01, 0x20
_TIOCSTI, _TIOCLINUX = 0x5412, 0x541C

_DENIED: dict[str, tuple[int | None, int | None]] = {
    # namespaces and mounts
    "unshare": (272, 97),
    "setns": (308, 268),
    "mount": (165, 40),
    "umount2": (166, 39),
    "pivot_root": (155, 41),
    "chroot": (161, 51),
    "move_mount": (429, 429),
    "open_tree": (428, 428),
    "fsopen": (430, 430),
    "fsconfig": (431, 431),
    "fsmount": (432, 432),
    "fspick": (433, 433),
    "mount_setattr": (442, 442),
    # other processes
    "ptrace": (101, 117),
    "process_vm_readv": (310, 270),
    "process_vm_writev": (311, 271),
    "process_madvise": (440, 440),
    "process_mrelease": (448, 448),
    "pidfd_open": (434, 434),
    "pidfd_getfd": (438, 438),
    "pidfd_send_signal": (424, 424),
    "kcmp": (312, 272),
    # the network, and channels between processes
    "socket": (41, 198),
    "socketpair": (53, 199),
    "mq_open": (240, 180),
    "msgget": (68, 186),
    "semget": (64, 190),
    # memory that no limit counts
    "memfd_create": (319, 279),
    "memfd_secret": (447, 447),
    "shmget": (29, 194),
    "shmat": (30, 196),
    "io_setup": (206, 0),
    "remap_file_pages": (216, 234),
    "vmsplice": (278, 75),
    # links, devices and rights left behind
    "symlink": (88, None),
    "symlinkat": (266, 36),
    "link": (86, None),
    "linkat": (265, 37),
    "mknod": (133, None),
    "mknodat": (259, 33),
    "chmod": (90, None),
    "fchmod": (91, 52),
    "fchmodat": (268, 53),
    "chown": (92, None),
    "fchown": (93, 55),
    "lchown": (94, None),
    "fchownat": (260, 54),
    "setxattr": (188, 5),
    "lsetxattr": (189, 6),
    "fsetxattr": (190, 7),
    "truncate": (76, 45),
    "utime": (132, None),
    "utimes": (235, None),
    "futimesat": (261, None),
    "utimensat": (280, 88),
    "removexattr": (197, 14),
    "lremovexattr": (198, 15),
    "fremovexattr": (199, 16),
    "name_to_handle_at": (303, 264),
    "open_by_handle_at": (304, 265),
    # kernel interfaces that pictures do not need
    "bpf": (321, 280),
    "perf_event_open": (298, 241),
    "userfaultfd": (323, 282),
    "io_uring_setup": (425, 425),
    "io_uring_enter": (426, 426),
    "io_uring_register": (427, 427),
    "keyctl": (250, 219),
    "add_key": (248, 217),
    "request_key": (249, 218),
    "fanotify_init": (300, 262),
    "modify_ldt": (154, None),
    "iopl": (172, None),
    "ioperm": (173, None),
    "lookup_dcookie": (212, 18),
    "move_pages": (279, 239),
    "migrate_pages": (256, 238),
    "mbind": (237, 235),
    "sched_setscheduler": (144, 119),
    "sched_setattr": (314, 274),
    # the machine
    "kexec_load": (246, 104),
    "kexec_file_load": (320, 294),
    "reboot": (169, 142),
    "swapon": (167, 224),
    "swapoff": (168, 225),
    "init_module": (175, 105),
    "finit_module": (313, 273),
    "delete_module": (176, 106),
    "quotactl": (179, 60),
    "quotactl_fd": (443, 443),
    "acct": (163, 89),
    "syslog": (103, 116),
    "vhangup": (153, 58),
    "sethostname": (170, 161),
    "setdomainname": (171, 162),
    "settimeofday": (164, 170),
    "clock_settime": (227, 112),
    "clock_adjtime": (305, 266),
    "adjtimex": (159, 171),
    "nfsservctl": (180, 42),
    "uselib": (134, None),
}
"""The calls that fail with EPERM, with their numbers on x86-64 and on ARM64; None where there is no such call."""

_JUDGED: dict[str, tuple[int | None, int | None]] = {
    "clone": (56, 220),
    "clone3": (435, 435),
    "fork": (57, None),
    "vfork": (58, None),
    "mmap": (9, 222),
    "ioctl": (16, 29),
    "personality": (135, 92),
}
"""The calls that fail with some arguments."""


def filter_path(*, forks: bool, maps_shared: bool = False) -> str:
    """Return a path from which a child process of this one can read the filter.

    The file is in memory. The path names this process, so it is good while this process lives.

    Parameters
    ----------
    forks
        False to refuse new processes; threads are always allowed.
    maps_shared
        True to allow shared mappings of files, which drivers of GPUs need.

    Raises
    ------
    SandboxMissing
        If there is no table for this kind of processor.
    """
    pid = os.getpid()
    return f"/proc/{pid}/fd/{_filter_file(pid, forks, maps_shared)}"


@lru_cache(maxsize=8)
def _filter_file(_pid: int, forks: bool, maps_shared: bool) -> int:
    descriptor = os.memfd_create("lippmann-filter")
    os.write(descriptor, filter_program(platform.machine(), forks=forks, maps_shared=maps_shared))
    return descriptor


def filter_program(machine: str, *, forks: bool, maps_shared: bool = False) -> bytes:
    """Return the filter as an array of `struct sock_filter`; see `filter_path`.

    Raises
    ------
    SandboxMissing
        If there is no table for this kind of processor.
    """
    if machine not in _AUDIT_ARCH:
        raise SandboxMissing(f"expected an x86-64 or ARM64 processor for the sandbox, got {machine}")
    column = _COLUMN[machine]
    program = [
        _step(_LOAD, _ARCH),
        _step(_EQUAL, _AUDIT_ARCH[machine], 1, 0),
        _step(_RETURN, _KILL),
        _step(_LOAD, _NR),
        # Newer calls, and those of x32, which have a bit of their own.
        _step(_GREATER, _NEWEST, 0, 1),
        _refuse(errno.ENOSYS),
    ]
    assert _X32_BIT > _NEWEST  # noqa: S101 - one comparison refuses both
    for numbers in _DENIED.values():
        program += _when_called(numbers[column], [_refuse(errno.EPERM)])
    for name, rule in _rules(forks=forks, maps_shared=maps_shared).items():
        program += _when_called(_JUDGED[name][column], rule)
    return b"".join([*program, _step(_RETURN, _ALLOW)])


def _rules(*, forks: bool, maps_shared: bool) -> dict[str, list[bytes]]:
    """Return what follows when a judged call is made; each rule ends with a return."""
    refuse, allow = _refuse(errno.EPERM), _step(_RETURN, _ALLOW)
    new_process = [] if forks else [_step(_ANY_BIT, _CLONE_THREAD, 1, 0), refuse]
    return {
        "clone": [_argument(0), _step(_ANY_BIT, _CLONE_NAMESPACES, 0, 1), refuse, *new_process, allow],
        # Its flags are in memory that a filter cannot read; the C library then calls clone.
        "clone3": [_refuse(errno.ENOSYS)],
        "fork": [allow if forks else refuse],
        "vfork": [allow if forks else refuse],
        # A shared mapping of a file that was removed keeps room on the disk that nothing shows.
        "mmap": [
            _argument(3),
            _step(_ANY_BIT, _MAP_ANONYMOUS, 2, 0),
            _step(_ANY_BIT, _MAP_SHARED, 0, 1),
            allow if maps_shared else refuse,
            allow,
        ],
        "ioctl": [_argument(1), _step(_EQUAL, _TIOCSTI, 1, 0), _step(_EQUAL, _TIOCLINUX, 0, 1), refuse, allow],
        "personality": [_argument(0), _step(_EQUAL, 0, 1, 0), _step(_EQUAL, 0xFFFFFFFF, 0, 1), allow, refuse],
    }


def _when_called(number: int | None, rule: list[bytes]) -> list[bytes]:
    return [] if number is None else [_step(_EQUAL, number, 0, len(rule)), *rule]


def _argument(index: int) -> bytes:
    """Load the lower half of an argument, on a little-endian machine."""
    return _step(_LOAD, 16 + 8 * index)


def _refuse(number: int) -> bytes:
    return _step(_RETURN, _ERRNO | number)


def _step(code: int, value: int, if_true: int = 0, if_false: int = 0) -> bytes:
    return struct.pack("=HBBI", code, if_true, if_false, value)
