"""The filter of system calls, as a program and in the kernel."""

from __future__ import annotations

import errno
import os
import platform
import re
import struct
from pathlib import Path

import pytest

from lippmann.errors import SandboxMissing
from worker.sandbox import seccomp
from worker.sandbox.seccomp import filter_path, filter_program

HEADERS = {
    "x86_64": Path("/usr/include/x86_64-linux-gnu/asm/unistd_64.h"),
    "aarch64": Path("/usr/include/asm-generic/unistd.h"),
}
ALLOW, KILL, EPERM, ENOSYS = 0x7FFF0000, 0x80000000, 0x50000 | errno.EPERM, 0x50000 | errno.ENOSYS
ARCH = {"x86_64": 0xC000003E, "aarch64": 0xC00000B7}
MACHINES = sorted(ARCH)


def answer(program: bytes, number: int, *arguments: int, arch: int) -> int:
    """Return what the kernel would: a machine for the few instructions that the filter has."""
    data = struct.pack("<IIQ6Q", number, arch, 0, *arguments, *[0] * (6 - len(arguments)))
    steps = list(struct.iter_unpack("=HBBI", program))
    at, loaded = 0, 0
    while True:
        code, if_true, if_false, value = steps[at]
        at += 1
        if code == 0x20:
            (loaded,) = struct.unpack_from("<I", data, value)
        elif code == 0x06:
            return int(value)
        else:
            holds = {0x15: loaded == value, 0x25: loaded > value, 0x45: loaded & value != 0}[code]
            at += if_true if holds else if_false


@pytest.mark.parametrize("machine", MACHINES)
@pytest.mark.parametrize("forks", [True, False])
def test_what_is_denied_is_refused_and_ordinary_calls_are_allowed(machine: str, forks: bool) -> None:
    program, column = filter_program(machine, forks=forks), MACHINES[::-1].index(machine)
    for name, numbers in seccomp._DENIED.items():
        if (number := numbers[column]) is not None:
            assert answer(program, number, arch=ARCH[machine]) == EPERM, name
    read = (0, 63)[column]
    assert answer(program, read, arch=ARCH[machine]) == ALLOW
    assert answer(program, read, arch=0x40000003) == KILL
    assert answer(program, 451, arch=ARCH[machine]) == ENOSYS
    assert answer(program, 0x40000000, arch=ARCH[machine]) == ENOSYS
    judged = {name: numbers[column] for name, numbers in seccomp._JUDGED.items()}
    cases: dict[tuple[str, tuple[int, ...]], int] = {
        ("clone", (0x11,)): ALLOW if forks else EPERM,
        ("clone", (0x3D0F00,)): ALLOW,
        ("clone", (0x10000011,)): EPERM,
        ("clone", (0x40010000,)): EPERM,
        ("clone3", (0,)): ENOSYS,
        ("fork", (0,)): ALLOW if forks else EPERM,
        ("mmap", (0, 0, 0, 0x01)): EPERM,
        ("mmap", (0, 0, 0, 0x21)): ALLOW,
        ("mmap", (0, 0, 0, 0x02)): ALLOW,
        ("ioctl", (0, 0x5412)): EPERM,
        ("ioctl", (0, 0x541C)): EPERM,
        ("ioctl", (0, 0x5401)): ALLOW,
        ("personality", (0,)): ALLOW,
        ("personality", (0xFFFFFFFF,)): ALLOW,
        ("personality", (0x40000,)): EPERM,
    }
    for (name, arguments), expected in cases.items():
        if (number := judged[name]) is not None:
            assert answer(program, number, *arguments, arch=ARCH[machine]) == expected, (name, arguments)


@pytest.mark.parametrize("machine", MACHINES)
def test_files_are_mapped_shared_for_a_driver_alone(machine: str) -> None:
    number = seccomp._JUDGED["mmap"][MACHINES[::-1].index(machine)]
    assert number is not None
    for maps_shared, expected in ((False, EPERM), (True, ALLOW)):
        program = filter_program(machine, forks=True, maps_shared=maps_shared)
        assert answer(program, number, 0, 0, 0, 0x01, arch=ARCH[machine]) == expected


@pytest.mark.parametrize("machine", MACHINES)
def test_the_numbers_are_those_of_the_kernels_headers(machine: str) -> None:
    if not HEADERS[machine].exists():
        pytest.skip("the headers of the kernel are not installed")
    found = dict(re.findall(r"#define __NR(?:3264)?_(\w+)\s+(\d+)", HEADERS[machine].read_text()))
    column = MACHINES[::-1].index(machine)
    table = {**seccomp._DENIED, **seccomp._JUDGED}
    assert {name: numbers[column] for name, numbers in table.items()} == {
        name: int(found[name]) if name in found else None for name in table
    }


def test_another_processor_has_no_sandbox() -> None:
    with pytest.raises(SandboxMissing, match="got riscv64"):
        filter_program("riscv64", forks=True)


def test_a_child_can_read_the_filter_and_so_can_the_child_of_a_fork() -> None:
    expected = filter_program(platform.machine(), forks=False)
    assert Path(filter_path(forks=False)).read_bytes() == expected
    reader, writer = os.pipe()
    if (child := os.fork()) == 0:
        os.write(writer, b"same" if Path(filter_path(forks=False)).read_bytes() == expected else b"other")
        os._exit(0)
    os.waitpid(child, 0)
    assert os.read(reader, 10) == b"same"
    os.close(reader)
    os.close(writer)
