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
from itertools import islice
from pathlib import Path
from statistics import median

from tests.chaos.kinds import KINDS, Kind, Work
from tests.chaos.trial import Pixels, Verdict, go_through, undisturbed
from tests.ctrl_c import heed_ctrl_c
from tests.leftovers import watch_this_run
from tests.network_host import why_no_network_host

PAGE = Path("docs/chaos.md")
KEPT = Path("tests/chaos/trials.jsonl")
"""All trials whose records are kept."""
EARLIER = Path("tests/chaos/earlier.json")
"""The numbers of trials, and of those that were right, whose records were not kept, by kind."""
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
    parser.add_argument(
        "--part",
        type=_part,
        default=(1, 1),
        help="take every Nth of those trials, from the Kth on [default: 1/1]",
        metavar="K/N",
    )
    parser.add_argument("--out", type=Path, default=Path("out/chaos"), help="the folder of the results")
    parser.add_argument(
        "--write", action="store_true", help=f"keep the results in {KEPT}, and write the table of all into {PAGE}"
    )
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
        first, step = options.part
        return _try(islice(_missing(kinds, options.until, out), first - 1, None, step), out)
    seeds = range(options.seed, options.seed + options.runs)
    return _try(((kind, seed) for seed in seeds for kind in kinds), out)


def _part(text: str) -> tuple[int, int]:
    first, slash, step = text.partition("/")
    if not (slash and first.isdecimal() and step.isdecimal() and 1 <= int(first) <= int(step)):
        raise argparse.ArgumentTypeError(f"expected K/N with 1 <= K <= N, got {text!r}")
    return int(first), int(step)


def _missing(kinds: Sequence[Kind], until: int, out: Path) -> Iterator[tuple[Kind, int]]:
    """Yield the trials that the results lack, the kinds with the fewest first, with seeds that none of them had."""
    earlier = json.loads(EARLIER.read_text())
    results = {result.json(): result for result in (*_results(KEPT), *_results(out / "results.jsonl"))}
    trials = {kind.name: earlier.get(kind.name, [0])[0] for kind in kinds}
    last_seed = dict(trials)
    for result in results.values():
        if result.kind in trials:
            trials[result.kind] += 1
            last_seed[result.kind] = max(last_seed[result.kind], result.seed)
    for least in range(until):
        for kind in kinds:
            if trials[kind.name] <= least:
                trials[kind.name] += 1
                last_seed[kind.name] += 1
                yield kind, last_seed[kind.name]


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


def _results(file: Path) -> list[Verdict]:
    return [Verdict(**json.loads(line)) for line in file.read_text().splitlines()] if file.exists() else []


def _write(out: Path) -> None:
    """Keep the results of a folder, and write the table of all that are kept into the page of the docs."""
    kept = {result.json(): None for result in (*_results(KEPT), *_results(out / "results.jsonl"))}
    KEPT.write_text("".join(f"{line}\n" for line in kept))
    head, mark, _ = PAGE.read_text().partition(TABLE)
    assert mark, f"expected the line of the table in {PAGE}"
    PAGE.write_text(head + mark + "\n" + "\n".join(_table()) + "\n")


def _table() -> Iterator[str]:
    """Yield the lines of the table; its times are those of the trials whose records are kept."""
    results, earlier = _results(KEPT), json.loads(EARLIER.read_text())
    machine = f"{platform.machine()}, {os.cpu_count()} cores, {platform.system()} {platform.release()}"
    trials = sum(trials for trials, _ in earlier.values()) + len(results)
    yield f"{trials} trials, {time.strftime('%Y-%m-%d')}, {machine}. The times are those of {len(results)} of them."
    yield ""
    yield "| fault | trials | right | median | longest | attempts again | longest recovery |"
    yield "|---|---|---|---|---|---|---|"
    for name in KINDS:
        of_kind = [result for result in results if result.kind == name]
        trials, right = earlier.get(name, (0, 0))
        cells = [name, trials + len(of_kind), right + sum(not result.wrong for result in of_kind), *_times(of_kind)]
        yield f"| {' | '.join(map(str, cells))} |"


def _times(results: Sequence[Verdict]) -> tuple[str, str, str, str]:
    """Return the median and the longest time, the mean number of attempts again, and the longest recovery."""
    if not results:
        return "", "", "", ""
    seconds = [result.seconds for result in results]
    again = sum(result.attempts_again for result in results) / len(results)
    recoveries = [result.recovered_s for result in results if result.recovered_s is not None]
    recovery = f"{max(recoveries):.0f} s" if recoveries else ""
    return f"{median(seconds):.0f} s", f"{max(seconds):.0f} s", f"{again:.1f}", recovery


if __name__ == "__main__":
    sys.exit(main())
