"""Fuzz the readers of foreign text: `python -m tests.security.fuzz --inputs 100000`.

Every reader is given mutations of valid texts and structural bombs, which depend on the seed alone. A reader may return
or refuse; any other exception, a second of processor time for one input, and 200 MB of memory are findings.
"""

from __future__ import annotations

import argparse
import resource
import sys
import time
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from random import Random

from lippmann.errors import LippmannError
from lippmann.logs import trace_of
from tests.security.file_readers import DECODER, FILE_READERS
from tests.security.readers import READERS, Make, Read, job_bytes, request_reader

MAX_CPU_S = 1.0
MAX_GROWTH_BYTES = 200_000_000
MAX_FINDINGS = 20
"""The number of findings after which a reader is given up."""


DIRECT = {**READERS, **FILE_READERS, "decoder": DECODER}
"""The readers that need nothing else."""
ALL = (*DIRECT, "request")
SLOWER = {"decoder": 200}
"""The readers that get fewer inputs, because each input starts a process."""


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

    def __str__(self) -> str:
        return (
            f"{self.name:<12} {self.inputs:>8} inputs, {self.accepted:>7} accepted, longest {self.longest_s:6.3f} s, "
            f"memory +{self.growth_bytes / 1e6:.0f} MB, {len(self.findings)} findings"
        )


def fuzz(name: str, make: Make, read: Read, *, inputs: int, seed: int) -> Report:
    """Give inputs to a reader and report what it does."""
    report, before = Report(name), _peak_bytes()
    for number in range(inputs):
        data = make(Random(f"{seed}/{name}/{number}"))
        report.inputs += 1
        finding = _try(read, data, report)
        grown = _peak_bytes() - before
        if grown - report.growth_bytes > MAX_GROWTH_BYTES:
            finding = finding or f"memory grew by {(grown - report.growth_bytes) / 1e6:.0f} MB"
        report.growth_bytes = max(report.growth_bytes, grown)
        if finding:
            report.findings.append(f"{name} {seed}/{number}, {len(data)} bytes: {finding}")
            report.inputs_found.append(data)
        if len(report.findings) >= MAX_FINDINGS:
            break
    return report


def _try(read: Read, data: bytes, report: Report) -> str:
    began_s, finding = time.process_time(), ""
    try:
        read(data)
        report.accepted += 1
    except LippmannError:
        pass
    except Exception as error:
        finding = trace_of(error)
    took_s = time.process_time() - began_s
    report.longest_s = max(report.longest_s, took_s)
    return finding or (f"took {took_s:.2f} s" if took_s > MAX_CPU_S else "")


def _peak_bytes() -> int:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; the exit code is 1 if there are findings."""
    parser = argparse.ArgumentParser(prog="python -m tests.security.fuzz", description=__doc__)
    parser.add_argument("--inputs", type=int, default=1000, help="the number of inputs of each reader")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--reader", action="append", choices=ALL, help="only this reader")
    parser.add_argument("--keep", type=Path, help="a folder for the inputs of the findings")
    options = parser.parse_args(arguments)
    found = 0
    with ExitStack() as stack:
        for name in options.reader or ALL:
            make, read = (job_bytes, stack.enter_context(request_reader())) if name == "request" else DIRECT[name]
            inputs = options.inputs // SLOWER.get(name, 1)
            report = fuzz(name, make, read, inputs=inputs, seed=options.seed)
            print(report, *report.findings, sep="\n", flush=True)
            found += len(report.findings)
            if options.keep:
                options.keep.mkdir(parents=True, exist_ok=True)
                for number, data in enumerate(report.inputs_found):
                    (options.keep / f"{name}-{number}").write_bytes(data)
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
