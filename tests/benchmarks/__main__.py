"""Measure and print one table; every figure is taken here and now."""

from __future__ import annotations

import argparse
import json
import os
import platform
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from tests.benchmarks import (
    bad_clients,
    buckets,
    celery_tasks,
    command,
    coordinator,
    engines,
    farm,
    farm_meshes,
    joining,
    listening,
    looks,
    losses,
    memory,
    observer,
    optics,
    pages,
    previews,
    refocus,
    sandbox,
    sheets,
    videos,
    viewer,
)
from tests.ctrl_c import heed_ctrl_c
from tests.leftovers import watch_this_run

PAGE = Path("docs/benchmarks.md")
TABLE = "<!-- the table is written by `make bench ARGS=--write` -->\n"


@dataclass(frozen=True)
class Line:
    """One line of the table."""

    what: str
    goal: str
    measure: Callable[[Path], str]


LINES = (
    Line("12 frames of 720 x 720 on 2 slots / plain povray +WT1, two at a time: wall", "<= 1.03", farm.frames_ratio),
    Line("90 frames of 0.5 s on 2 slots / the same: wall", "<= 0.80", farm.short_frames_ratio),
    Line("one frame of 2400 x 2400 on 2 slots / plain povray +WT2: wall", "<= 1.00", farm.still_ratio),
    Line("slots without a task while 12 frames render", "<= 2 %", farm.idle_share),
    Line("assemble / render: CPU", "<= 5 %", farm.assemble_share),
    Line(
        "45 frames of the fish in meshes on 2 slots / a loop around Mitsuba, two at a time: wall; CPU of the tasks",
        "<= 1.15, -",
        farm_meshes.video_ratio,
    ),
    Line("recovery of 20 kills of pool processes and workers: p95", "<= 15 s", losses.recovery_p95),
    Line("bubblewrap around a task, its result taken out: wall", "<= 30 ms", sandbox.bwrap_ms),
    Line("Landlock around a task, the same: wall", "<= 30 ms", sandbox.landlock_ms),
    Line("optics by ray camera / pinhole camera, fish, 90 x 90 lenses of 8 px: CPU", "<= 2.0", optics.ray_camera_ratio),
    Line("optics as glass / pinhole camera, the same: CPU", "-", optics.glass_ratio),
    Line("growth with pixels per lens (Fig. 8): largest deviation from linear", "<= 10 %", optics.growth),
    Line(
        "fish in meshes by Mitsuba, warm / by POV-Ray's ray camera, 90 x 90 lenses of 8 px: CPU",
        "<= 1/12",
        engines.small_ratio,
    ),
    Line("fish in meshes, the same, 100 x 100 lenses of 24 px: CPU", "<= 1/15", engines.large_ratio),
    Line("fish in meshes, the same, 90 x 90 lenses of 8 px in a new process: CPU", "<= 0.67", engines.cold_ratio),
    Line(
        "fish in meshes by Mitsuba: the rig / a pinhole camera, the same pixels: CPU", "<= 1.25", engines.pinhole_ratio
    ),
    Line("fish in meshes by Mitsuba, 2400 x 2400 px: peak memory", "<= 0.8 GB", engines.peak_mb),
    Line("fish in meshes by Mitsuba: 16 rays a pixel / 1: CPU", "<= 14", engines.samples_ratio),
    Line(
        "a preview of the fish in meshes, warm, 45 x 45 lenses of 8 px, over HTTP: wall", "<= 300 ms", previews.warm_ms
    ),
    Line(
        "tasks that do nothing through Celery, 2 slots: rate, and against bare Celery",
        ">= 400/s, >= 0.40",
        celery_tasks.rate,
    ),
    Line("one coordinator with 1,000 simulated slots, SQLite", ">= 1,000/s", coordinator.sqlite_rate),
    Line("one coordinator with 1,000 simulated slots, PostgreSQL", ">= 600/s", coordinator.postgresql_rate),
    Line("dispatch and follow in a job of 300,000 tasks / of 200: CPU", "<= 1.1", coordinator.follow_ratio),
    Line("coordinator with 2,000 jobs that wait: share of a core", "<= 2 %", coordinator.idle_share),
    Line(
        "the paper's video on a bucket on loopback / on a disk: wall, also of its fetch", "<= 1.10", buckets.video_ratio
    ),
    Line("a worker joins a farm with waiting work, until it renders", "<= 5 s", joining.start_s),
    Line("start of `up` to its first answer", "<= 5 s", command.start_s),
    Line("`lippmann --help`", "<= 0.5 s", command.help_s),
    Line("`up` idle, all processes: memory (PSS)", "<= 600 MB", command.idle_mb),
    Line(
        "500 stream clients on a running job / none: p95 of events and of the job list, tasks, memory (PSS)",
        "<= 1 s, <= 50 ms, -, <= 300 MB",
        listening.with_clients,
    ),
    Line(
        "a healthy client beside slow headers, half requests, a flood, 500 streams, expensive pictures / alone: p95",
        "<= 3.0",
        bad_clients.healthy_ratio,
    ),
    Line("the slowest page or list of 10,000 jobs and 1,000,000 tasks: p95", "<= 50 ms", pages.slowest_page),
    Line("a picture on demand, its sheet in memory: wall", "<= 50 ms", looks.slowest_ms),
    Line(
        "the viewer of a finished job opens on loopback: first picture, and bytes of views before a movement",
        "<= 0.5 s, <= 150 kB",
        viewer.first_picture,
    ),
    Line(
        "a drag in the viewer without a graphics card, 8 x 8 views of 90 x 90: median, p95 to paint, and its sway",
        "<= 60 ms, -, -",
        viewer.small_drag,
    ),
    Line("a drag in the viewer, 24 x 24 views of 100 x 100: the same", "-, -, -", viewer.large_drag),
    Line("what an eye sees, 90 x 90 lenses of 8 px to 720 px: one ray a pixel", "<= 50 ms", observer.one_ray_ms),
    Line("what an eye sees, the same: 64 rays through the pupil", "<= 1000 ms", observer.pupil_ms),
    Line("what an eye sees by 1, 4, 16, 64, 256 rays differs from 4096: RMS codes", "-", observer.rays_differ),
    Line("half-turn of 2400 x 2400 x 3 half floats / a memory copy: CPU", "<= 5.0", sheets.half_turn_ratio),
    Line("all views of 2400 x 2400 x 3 half floats / a memory copy: CPU", "<= 5.0", sheets.views_ratio),
    Line("turn 8000 x 8000 both ways, and all views, file to file: peak memory", "<= 1 GiB", sheets.streamed_mb),
    Line("assemble a 2400 x 2400 frame: peak memory", "<= 1 GiB", memory.assemble_mb),
    Line("refocus, 64 views of 1280 x 720: planes in a CPU second, a stack of 16", ">= 10", refocus.planes_per_s),
    Line(
        "refocus 640 x 360 by dense matrices / by scipy's sparse ones: CPU",
        "<= 0.77",
        refocus.sparse_ratio,
    ),
    Line("encoding views.mp4 / the codec alone, 128 views to 720 x 720 px: CPU", "<= 1.15", videos.cpu_ratio),
)


def main() -> int:
    """Measure the lines whose words hold the argument, all without one; or write the table of what was measured."""
    parser = argparse.ArgumentParser(prog="make bench", description=__doc__)
    parser.add_argument("only", nargs="?", default="", help="words of the lines to measure")
    parser.add_argument("--out", type=Path, default=Path("out/bench"), help="the folder of the results")
    parser.add_argument("--write", action="store_true", help=f"write the table of the newest results into {PAGE}")
    options = parser.parse_args()
    if options.write:
        _write(options.out)
        return 0
    heed_ctrl_c()
    watch_this_run()
    options.out.mkdir(parents=True, exist_ok=True)
    print(f"{_machine()}, {time.strftime('%Y-%m-%d %H:%M')}")
    width = max(len(line.what) for line in LINES)
    for line in LINES:
        if options.only in line.what:
            with tempfile.TemporaryDirectory(prefix="lippmann-bench-") as folder:
                measured = line.measure(Path(folder))
            print(f"{line.what:<{width}}  {measured:>16}  goal {line.goal}", flush=True)
            result = {"what": line.what, "measured": measured, "date": time.strftime("%Y-%m-%d"), "on": _machine()}
            with (options.out / "results.jsonl").open("a") as results:
                results.write(json.dumps(result) + "\n")
    return 0


def _machine() -> str:
    return f"{platform.machine()}, {os.cpu_count()} cores, {platform.system()} {platform.release()}"


def _write(out: Path) -> None:
    """Write the newest result of each line into the page of the docs."""
    results = [json.loads(line) for line in (out / "results.jsonl").read_text().splitlines()]
    newest = {result["what"]: result for result in results}
    machines = sorted({result["on"] for result in newest.values()})
    lines = [f"Measured on: {'; '.join(machines)}.", "", "| what | measured | goal | date |", "|---|---|---|---|"]
    for line in LINES:
        if line.what in newest:
            result = newest[line.what]
            lines.append(f"| {line.what} | {result['measured']} | {line.goal} | {result['date']} |")
    head, mark, _ = PAGE.read_text().partition(TABLE)
    assert mark, f"expected the line of the table in {PAGE}"
    PAGE.write_text(head + mark + "\n" + "\n".join(lines) + "\n")


if __name__ == "__main__":
    sys.exit(main())
