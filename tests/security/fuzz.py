"""Fuzz the readers of foreign text: `python -m tests.security.fuzz --inputs 100000`.

Every reader is given mutations of valid texts and structural bombs, which depend on the seed alone. A reader may return
or refuse; any other exception, a second of processor time for one input, and 200 MB of memory are findings.

The readers take turns, with a share of the inputs each time, in a process for each share: a run that is ended early has
tried all of them about equally, and a reader that crashes or never returns is a finding.
"""

from __future__ import annotations

import argparse
import os
import resource
import signal
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from random import Random
from types import FrameType

from lippmann.errors import LippmannError
from lippmann.logs import trace_of
from tests.security.file_readers import DECODER, FILE_READERS
from tests.security.readers import READERS, Make, Read, job_bytes, request_reader
from tests.security.scene_readers import SCENE_READERS
from tests.security.shares import run_shares

MAX_CPU_S = 1.0
ENDLESS_S = 20
"""The processor time after which a reader does not return."""
MAX_GROWTH_BYTES = 200_000_000
MAX_MEMORY_BYTES = 6_000_000_000
"""The address space of a share."""
MAX_FINDINGS = 20
"""The number of findings after which a reader is given up."""


DIRECT = {**READERS, **FILE_READERS, **SCENE_READERS, "decoder": DECODER}
"""The readers that need nothing else."""
ALL = (*DIRECT, "request")
SLOWER = {"decoder": 200}
"""The readers that get fewer inputs, because each input starts a process."""
SHARE = 2000
"""The inputs of a share; a slower reader gets fewer."""
SAY_S = 60.0
"""The interval of lines about how far the run is."""


@dataclass(frozen=True)
class Share:
    """Some of the inputs of a reader, by their numbers."""

    name: str
    numbers: range
    seed: int


@dataclass
class Report:
    """The results of one reader."""

    name: str
    inputs: int = 0
    accepted: int = 0
    longest_s: float = 0.0
    growth_bytes: int = 0
    findings: list[str] = field(default_factory=list)
    """What went wrong, each with the seed of its input."""
    inputs_found: list[bytes] = field(default_factory=list)

    def add(self, other: Report) -> None:
        """Add the results of a share."""
        self.inputs += other.inputs
        self.accepted += other.accepted
        self.longest_s = max(self.longest_s, other.longest_s)
        self.growth_bytes = max(self.growth_bytes, other.growth_bytes)
        self.findings += other.findings

    def __str__(self) -> str:
        return (
            f"{self.name:<12} {self.inputs:>8} inputs, {self.accepted:>7} accepted, longest {self.longest_s:6.3f} s, "
            f"memory +{self.growth_bytes / 1e6:.0f} MB, {len(self.findings)} findings"
        )


def fuzz(name: str, make: Make, read: Read, *, inputs: int | range, seed: int) -> Report:
    """Give inputs to a reader, a number of them or those with these numbers, and report what it does."""
    report = Report(name)
    for number in range(inputs) if isinstance(inputs, int) else inputs:
        data = make(Random(f"{seed}/{name}/{number}"))
        report.inputs += 1
        before = _memory_bytes("VmRSS")
        # The peak begins anew: the maker of an input may have had one of its own.
        Path("/proc/self/clear_refs").write_text("5")
        finding = _try(read, data, report)
        grown = _memory_bytes("VmHWM") - before
        if grown > MAX_GROWTH_BYTES:
            finding = finding or f"memory grew by {grown / 1e6:.0f} MB"
        report.growth_bytes = max(report.growth_bytes, grown)
        if finding:
            report.findings.append(f"{name} {seed}/{number}, {len(data)} bytes: {finding}")
            report.inputs_found.append(data)
        if len(report.findings) >= MAX_FINDINGS:
            break
    return report


def fuzz_share(share: Share) -> Report:
    """Give a share of the inputs to a reader, in a process of its own."""
    resource.setrlimit(resource.RLIMIT_AS, (MAX_MEMORY_BYTES, MAX_MEMORY_BYTES))
    with ExitStack() as stack:
        is_request = share.name == "request"
        make, read = (job_bytes, stack.enter_context(request_reader())) if is_request else DIRECT[share.name]
        return fuzz(share.name, make, read, inputs=share.numbers, seed=share.seed)


def shares(names: Sequence[str], inputs: int, *, seed: int, first: int = 0) -> Iterator[Share]:
    """Yield the shares of all readers, which take turns.

    >>> [(share.name, len(share.numbers)) for share in shares(["job", "decoder"], 3000, seed=1)]
    [('job', 2000), ('decoder', 10), ('job', 1000), ('decoder', 5)]
    """
    for start in range(first, inputs, SHARE):
        for name in names:
            slower = SLOWER.get(name, 1)
            yield Share(name, range(start // slower, min(start + SHARE, inputs) // slower), seed)


def _try(read: Read, data: bytes, report: Report) -> str:
    began_s, finding = _cpu_s(), ""
    try:
        with _endless():
            read(data)
        report.accepted += 1
    except LippmannError:
        pass
    except Exception as error:
        finding = trace_of(error)
    took_s = _cpu_s() - began_s
    report.longest_s = max(report.longest_s, took_s)
    return finding or (f"took {took_s:.2f} s" if took_s > MAX_CPU_S else "")


@contextmanager
def _endless() -> Iterator[None]:
    """Raise an error if the processor time of what is done here passes a limit."""

    def end(_number: int, _frame: FrameType | None) -> None:
        raise TimeoutError(f"it did not return within {ENDLESS_S} s")

    before = signal.signal(signal.SIGPROF, end)
    signal.setitimer(signal.ITIMER_PROF, ENDLESS_S)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, before)


def _cpu_s() -> float:
    """Return the processor time of this process and of the children that have ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + used.ru_utime + used.ru_stime


def _memory_bytes(name: str) -> int:
    """Return the resident memory of this process: `VmRSS` is that of now, and `VmHWM` is the peak."""
    lines = dict(line.split(":") for line in Path("/proc/self/status").read_text().splitlines())
    return int(lines[name].split()[0]) * 1024


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; the exit code is 1 if there are findings."""
    parser = argparse.ArgumentParser(prog="python -m tests.security.fuzz", description=__doc__)
    parser.add_argument("--inputs", type=int, default=1000, help="the number of inputs of each reader")
    parser.add_argument("--first", type=int, default=0, help="the number of the first input, where a run was ended")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--reader", action="append", choices=ALL, help="only this reader")
    parser.add_argument("--keep", type=Path, help="a folder for the inputs of the findings")
    parser.add_argument("--processes", type=int, default=os.cpu_count() or 1, help="the number of processes")
    parser.add_argument("--minutes", type=float, default=float("inf"), help="the time after which no share begins")
    options = parser.parse_args(arguments)
    names = options.reader or ALL
    totals = {name: Report(name) for name in names}
    # In the background, a shell lets its children ignore Ctrl-C.
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    wanted = shares(names, options.inputs, seed=options.seed, first=options.first)
    try:
        _run(wanted, totals, options.processes, options.keep, until_s=time.monotonic() + options.minutes * 60)
    finally:
        print(*totals.values(), sep="\n", flush=True)
        for name, report in totals.items():
            slower = SLOWER.get(name, 1)
            missing = options.inputs // slower - options.first // slower - report.inputs
            if missing:
                print(f"{name}: {missing} inputs were not tried", flush=True)
    return 1 if any(report.findings for report in totals.values()) else 0


def _run(wanted: Iterator[Share], totals: dict[str, Report], processes: int, keep: Path | None, until_s: float) -> None:
    tried = (share for share in wanted if len(totals[share.name].findings) < MAX_FINDINGS)
    began_s = said_s = time.monotonic()
    for share, report in run_shares(fuzz_share, tried, processes=processes, until_s=until_s):
        if report is None:
            report = Report(share.name, findings=[f"{share} ended its process"])
        totals[share.name].add(report)
        if report.findings:
            print(*report.findings, sep="\n", flush=True)
        if keep is not None and report.inputs_found:
            keep.mkdir(parents=True, exist_ok=True)
            for number, data in enumerate(report.inputs_found):
                (keep / f"{share.name}-{share.numbers.start}-{number}").write_bytes(data)
        if time.monotonic() - said_s > SAY_S:
            said_s = time.monotonic()
            inputs = sum(report.inputs for report in totals.values())
            print(f"{inputs} inputs in {(said_s - began_s) / 60:.0f} min, {share.name} at {share.numbers}", flush=True)


if __name__ == "__main__":
    sys.exit(main())
