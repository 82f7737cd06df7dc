"""Try every kind of fault several times, and print one line a trial: `make chaos`.

Exits with 1 if anything was wrong. The folders of trials that found something are kept.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import shutil
import sys
import time
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from statistics import median

from tests.chaos.kinds import KINDS, Kind, Work
from tests.chaos.trial import Pixels, Verdict, go_through, undisturbed
from tests.ctrl_c import heed_ctrl_c
from tests.leftovers import watch_this_run
from tests.network_host import why_no_network_host

PAGE = Path("docs/chaos.md")
TABLE = "<!-- the table is written by `make chaos ARGS=--write` -->\n"


def main() -> int:
    """Run what the arguments ask for; return the exit code."""
    parser = argparse.ArgumentParser(prog="make chaos", description=__doc__)
    parser.add_argument("only", nargs="*", help="words of the kinds to try; all without one")
    parser.add_argument("--list", action="store_true", help="list the kinds")
    parser.add_argument("--runs", type=int, default=5, help="trials of each kind [default: 5]")
    parser.add_argument("--seed", type=int, default=1, help="the seed of the first trial [default: 1]")
    parser.add_argument(
        "--until", type=int, help="try each kind until the results in the folder have this many trials of it"
    )
    parser.add_argument("--out", type=Path, default=Path("out/chaos"), help="the folder of the results")
    parser.add_argument("--write", action="store_true", help=f"write the table of all results into {PAGE}")
    options = parser.parse_args()
    kinds = [kind for name, kind in KINDS.items() if not options.only or any(word in name for word in options.only)]
    if options.list:
        print(*(kind.name for kind in kinds), sep="\n")
        return 0
    if options.write:
        _write(options.out)
        return 0
    heed_ctrl_c()
    watch_this_run()
    in_namespaces = [kind for kind in kinds if kind.hosts or kind.seven]
    if in_namespaces and (reason := why_no_network_host()):
        print(*(f"skipped: {kind.name} ({reason})" for kind in in_namespaces), sep="\n", flush=True)
        kinds = [kind for kind in kinds if kind not in in_namespaces]
    out = options.out.resolve()
    if options.until is not None:
        return _try(_missing(kinds, options.until, out), out)
    seeds = range(options.seed, options.seed + options.runs)
    return _try(((kind, seed) for seed in seeds for kind in kinds), out)


def _missing(kinds: Sequence[Kind], until: int, out: Path) -> Iterator[tuple[Kind, int]]:
    """Yield the trials that the results lack, the kinds with the fewest first, with seeds that none of them had."""
    had = {kind.name: [result.seed for result in _results(out) if result.kind == kind.name] for kind in kinds}
    for trials in range(until):
        for kind in kinds:
            if len(had[kind.name]) <= trials:
                seed = max(had[kind.name], default=0) + 1
                had[kind.name].append(seed)
                yield kind, seed


def _try(trials: Iterable[tuple[Kind, int]], out: Path) -> int:
    work = out / f"{time.strftime('%Y%m%d-%H%M%S')}-{os.getpid()}"
    right: dict[Work, Pixels] = {}
    bad = 0
    for number, (kind, seed) in enumerate(trials):
        folder = work / f"{number:03}-{seed}"
        if kind.work not in right:
            right[kind.work] = undisturbed(kind.work, work / f"undisturbed-{len(right)}")
        verdict = go_through(kind, seed, right[kind.work], folder)
        bad += bool(verdict.wrong)
        print(
            f"{verdict.seconds:7.1f} s  {kind.name} (seed {seed}): {'; '.join(verdict.wrong) or 'right'}",
            flush=True,
        )
        with (out / "results.jsonl").open("a") as results:
            results.write(verdict.json() + "\n")
        if not verdict.wrong:
            shutil.rmtree(folder)
    print(f"{bad} trials found something" + (f", their folders are in {work}" if bad else ""))
    return 1 if bad else 0


def _results(out: Path) -> list[Verdict]:
    file = out / "results.jsonl"
    return [Verdict(**json.loads(line)) for line in file.read_text().splitlines()] if file.exists() else []


def _write(out: Path) -> None:
    """Write the table of all results into the page of the docs."""
    results = _results(out)
    machine = f"{platform.machine()}, {os.cpu_count()} cores, {platform.system()} {platform.release()}"
    lines = [f"{len(results)} trials, {time.strftime('%Y-%m-%d')}, {machine}.", "",
             "| fault | trials | right | median | longest | attempts again | longest recovery |",
             "|---|---|---|---|---|---|---|"]  # fmt: skip
    for name in KINDS:
        of_kind = [result for result in results if result.kind == name]
        if of_kind:
            seconds = [result.seconds for result in of_kind]
            right = sum(not result.wrong for result in of_kind)
            again = sum(result.attempts_again for result in of_kind) / len(of_kind)
            recoveries = [result.recovered_s for result in of_kind if result.recovered_s is not None]
            cells = [name, len(of_kind), right, f"{median(seconds):.0f} s", f"{max(seconds):.0f} s", f"{again:.1f}"]
            cells.append(f"{max(recoveries):.0f} s" if recoveries else "")
            lines.append(f"| {' | '.join(map(str, cells))} |")
    head, mark, _ = PAGE.read_text().partition(TABLE)
    assert mark, f"expected the line of the table in {PAGE}"
    PAGE.write_text(head + mark + "\n" + "\n".join(lines) + "\n")


if __name__ == "__main__":
    sys.exit(main())
