"""Restrict this process with Landlock, then replace it by a program.

Run as a file of its own (`python -I -S landlock.py --filter PATH --user NUMBER --read PATH --device PATH --write PATH
-- PROGRAM ARGUMENT...`), so that nothing but the standard library is imported and the environment counts for nothing.
It needs no privilege and works where user namespaces are forbidden, such as in most containers. What the kernel's
Landlock can hold is held: files from ABI 1, TCP from ABI 4, signals and abstract sockets to others from ABI 6. The
filter of system calls takes away sockets of all kinds and new processes. The existence of files is not hidden.

The numbers are those of linux/landlock.h and linux/prctl.h.
"""

from __future__ import annotations

import ctypes
import errno
import os
import signal
import sys
from typing import NoReturn

REFUSED = 125
"""Exit code when the program was not started."""

SYSTEM = ("/usr", "/bin", "/lib", "/lib64")
DEVICES = ("/dev/null", "/dev/zero", "/dev/urandom", "/etc/ld.so.cache")

_CREATE_RULESET, _ADD_RULE, _RESTRICT_SELF = 444, 445, 446
_VERSION = 1
_PATH_BENEATH = 1
_PR_SET_PDEATHSIG, _PR_SET_SECCOMP, _PR_CAPBSET_DROP, _PR_SET_NO_NEW_PRIVS = 1, 22, 24, 38
_SECCOMP_MODE_FILTER = 2
_FILTER_STEP_BYTES = 8
_LAST_CAPABILITY = 63

_EXECUTE, _WRITE_FILE, _READ_FILE, _READ_DIR = 1 << 0, 1 << 1, 1 << 2, 1 << 3
_REMOVE_DIR, _REMOVE_FILE, _MAKE_DIR, _MAKE_REG = 1 << 4, 1 << 5, 1 << 7, 1 << 8
_TRUNCATE, _IOCTL_DEVICE = 1 << 14, 1 << 15
_READ = _READ_FILE | _READ_DIR
_WRITE = _READ | _WRITE_FILE | _REMOVE_DIR | _REMOVE_FILE | _MAKE_DIR | _MAKE_REG | _TRUNCATE
_USE_DEVICE = _READ_FILE | _WRITE_FILE | _IOCTL_DEVICE
_OF_FILES = _EXECUTE | _WRITE_FILE | _READ_FILE | _TRUNCATE | _IOCTL_DEVICE
_HANDLED = {1: (1 << 13) - 1, 2: (1 << 14) - 1, 3: (1 << 15) - 1, 4: (1 << 15) - 1, 5: (1 << 16) - 1}
"""The accesses to files that each ABI knows; later ones know the same as 5."""
_TCP = 0b11
_SCOPED = 0b11

_libc = ctypes.CDLL(None, use_errno=True)


class _Ruleset(ctypes.Structure):
    _fields_ = (
        ("handled_access_fs", ctypes.c_uint64),
        ("handled_access_net", ctypes.c_uint64),
        ("scoped", ctypes.c_uint64),
    )


class _FilterProgram(ctypes.Structure):
    _fields_ = (("steps", ctypes.c_ushort), ("program", ctypes.c_char_p))


class _PathBeneath(ctypes.Structure):
    _pack_ = 1
    _fields_ = (("allowed_access", ctypes.c_uint64), ("parent_fd", ctypes.c_int32))


def hold(readable: list[str], writable: list[str], devices: list[str]) -> None:
    """Hold this process and its children to these paths, for good.

    Raises
    ------
    OSError
        If the kernel has no Landlock, or a path is not there.
    """
    abi = _checked(_libc.syscall(_CREATE_RULESET, None, ctypes.c_size_t(0), _VERSION), "this kernel has no Landlock")
    handled = _HANDLED[min(abi, 5)]
    wanted = _Ruleset(handled, _TCP if abi >= 4 else 0, _SCOPED if abi >= 6 else 0)
    size = ctypes.c_size_t(8 if abi < 4 else 16 if abi < 6 else 24)
    ruleset = _checked(_libc.syscall(_CREATE_RULESET, ctypes.byref(wanted), size, 0), "no ruleset")
    for path in filter(os.path.exists, SYSTEM):
        _allow(ruleset, path, (_READ | _EXECUTE) & handled)
    for path in filter(os.path.exists, DEVICES):
        _allow(ruleset, path, (_READ_FILE | (_WRITE_FILE if path == "/dev/null" else 0)) & handled)
    for path in readable:
        _allow(ruleset, path, (_READ | _EXECUTE) & handled)
    for path in devices:
        _allow(ruleset, path, _USE_DEVICE & handled)
    for path in writable:
        _allow(ruleset, path, _WRITE & handled)
    _prctl(_PR_SET_NO_NEW_PRIVS, 1)
    _checked(_libc.syscall(_RESTRICT_SELF, ruleset, 0), "the rules were refused")
    os.close(ruleset)


def become(user: int | None) -> None:
    """Give up all capabilities for good, and become another user if one is given."""
    # Root would get its capabilities back at exec; without a bounding set there is nothing to get.
    if os.geteuid() == 0:
        for capability in range(_LAST_CAPABILITY + 1):
            _libc.prctl(_PR_CAPBSET_DROP, capability, 0, 0, 0)
    if user is not None:
        os.setgroups([])
        os.setresgid(user, user, user)
        os.setresuid(user, user, user)


def filter_calls(program: bytes) -> None:
    """Filter the system calls of this process and its children, for good; see `seccomp.py`."""
    steps = _FilterProgram(len(program) // _FILTER_STEP_BYTES, program)
    answer = _libc.prctl(_PR_SET_SECCOMP, _SECCOMP_MODE_FILTER, ctypes.byref(steps), 0, 0)
    _checked(answer, "the filter of system calls was refused")


def die_with_parent() -> None:
    """Ask the kernel to kill this process when the one that started it dies; it stays so after exec."""
    _prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)


def _allow(ruleset: int, path: str, access: int) -> None:
    place = os.open(path, os.O_PATH | os.O_CLOEXEC)
    try:
        rule = _PathBeneath(access if os.path.isdir(path) else access & _OF_FILES, place)
        _checked(_libc.syscall(_ADD_RULE, ruleset, _PATH_BENEATH, ctypes.byref(rule), 0), f"no rule for {path}")
    finally:
        os.close(place)


def _prctl(option: int, value: int) -> None:
    _checked(_libc.prctl(option, value, 0, 0, 0), f"prctl {option}")


def _checked(answer: int, fault: str) -> int:
    if answer < 0:
        number = ctypes.get_errno()
        raise OSError(number, f"{fault} ({errno.errorcode.get(number, number)})")
    return answer


def _options(words: list[str]) -> dict[str, list[str]]:
    options: dict[str, list[str]] = {"--filter": [], "--user": [], "--read": [], "--device": [], "--write": []}
    for option, value in zip(words[::2], words[1::2], strict=True):
        options[option].append(value)
    return options


def main(words: list[str]) -> NoReturn:
    """Restrict this process as the command line says and execute the program after `--`."""
    cut = words.index("--")
    program = words[cut + 1 :]
    try:
        options = _options(words[:cut])
        with open(options["--filter"][0], "rb") as file:
            calls = file.read()
        become(int(options["--user"][0]) if options["--user"] else None)
        hold(options["--read"], options["--write"], options["--device"])
        # The kernel forgets this when the user changes.
        die_with_parent()
        # Python ignores these two signals and the program would inherit that: nothing would end an endless file.
        for number in (signal.SIGPIPE, signal.SIGXFSZ):
            signal.signal(number, signal.SIG_DFL)
        filter_calls(calls)
        os.execvp(program[0], program)  # noqa: S606 - this file exists to execute a program
    except OSError as error:
        sys.stderr.write(f"landlock: {error}\n")
        sys.exit(REFUSED)


if __name__ == "__main__":
    main(sys.argv[1:])
