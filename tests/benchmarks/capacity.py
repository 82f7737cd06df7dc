"""The load that one coordinator, database, broker and bucket carry: `python -m tests.benchmarks.capacity --write`.

The rates are CPU time: what a task costs each part, so that they hold on a machine where the parts do not share two
cores. The feature-length video is computed from a frame that is rendered here.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import resource
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import psycopg

from lippmann.farm.supervisor.descendants import descendants
from lippmann.job.messages.orders import Order, TaskKind
from lippmann.job.spec import parse_spec
from lippmann.plan import artifact_names as names
from service.order_queue import OrderQueue
from tests.benchmarks.coordinator import FRAMES, coordinating, done_at, simulated_slots
from tests.broker import Broker
from tests.builders_messages import seals_in
from tests.builders_service import Farm
from tests.ctrl_c import heed_ctrl_c
from tests.farm import ended, farm_up
from tests.leftovers import watch_this_run
from tests.object_store import ObjectStore, running_object_store
from tests.postgresql import new_database, running_postgresql
from worker.store.local import LocalStore
from worker.store.s3 import S3Store

PAGE = Path("docs/capacity.md")
BEGIN, END = "<!-- measured -->\n", "<!-- end of what was measured -->\n"
TICKS = os.sysconf("SC_CLK_TCK")

MINUTES, FPS = 90, 24
VIDEO_FRAMES = MINUTES * 60 * FPS
"""The frames of a feature-length integral video."""
LENSES = 300
"""The lenses of a row and of a column, of 8 x 8 px each: 2400 x 2400 px."""
OBJECTS, OBJECT_BYTES = 60, 20_000_000
"""The objects that are written to the store and read from it: as many bytes as a master may have."""


@dataclass(frozen=True)
class Row:
    """One figure of the page."""

    what: str
    measured: str


@dataclass(frozen=True)
class Shares:
    """CPU seconds of the parts of a farm for one task."""

    coordinator: float
    database: float
    broker: float


def main() -> int:
    """Measure everything and print it."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.capacity", description=__doc__)
    parser.add_argument("--write", action="store_true", help=f"write the figures into {PAGE}")
    options = parser.parse_args()
    heed_ctrl_c()
    watch_this_run()
    rows = []
    for row in _rows():
        print(f"{row.what}: {row.measured}", flush=True)
        rows.append(row)
    if options.write:
        before, _, rest = PAGE.read_text().partition(BEGIN)
        _, mark, after = rest.partition(END)
        assert mark, f"expected the marks of the table in {PAGE}"
        table = ["| what | measured |", "|---|---|", *(f"| {row.what} | {row.measured} |" for row in rows)]
        when = f"Measured on {time.strftime('%Y-%m-%d')}, {os.cpu_count()} cores, Linux {os.uname().release}."
        PAGE.write_text(before + BEGIN + "\n" + when + "\n\n" + "\n".join(table) + "\n\n" + END + after)
    return 0


def _rows() -> Iterator[Row]:
    with tempfile.TemporaryDirectory(prefix="lippmann-capacity-") as name:
        folder = Path(name)
        yield from _shared_parts(folder)
        yield from _broker_memory(folder)
        yield from _stores(folder)
        yield from _video(folder)


def _shared_parts(folder: Path) -> Iterator[Row]:
    with running_postgresql() as server, new_database(server) as url:
        shares, bytes_a_task = _task_costs(url, folder)
    for part, name in (("coordinator", "coordinator"), ("database", "PostgreSQL"), ("broker", "Valkey")):
        cost_s = getattr(shares, part)
        yield Row(
            f"{name}: CPU of a task, and tasks a second by one core", f"{1e3 * cost_s:.2f} ms, {1 / cost_s:,.0f}/s"
        )
    yield Row("PostgreSQL: bytes of a task, with its indexes", f"{bytes_a_task:,.0f}")


def _task_costs(url: str, folder: Path) -> tuple[Shares, float]:
    """Return what a task costs each part with 1,000 simulated slots, and the bytes that it takes in the database."""
    farm = Farm(url, data_dir=folder)
    empty = _database_bytes(url)
    job_id = farm.planned(frames=f"1-{FRAMES}", outputs=[])
    broker, postmaster = Broker(folder), _postmaster(url)
    worker = multiprocessing.get_context("spawn").Process(
        target=simulated_slots, args=(broker.url, folder), daemon=True
    )
    worker.start()
    assert broker.process is not None
    with coordinating(farm, broker):

        def used_s() -> tuple[float, float, float]:
            own = resource.getrusage(resource.RUSAGE_SELF)
            return own.ru_utime + own.ru_stime, _cpu_s(postmaster), _cpu_s(broker.process.pid)

        # The first and the last tasks are not counted: the queue fills and empties.
        _, begun = done_at(farm.database, job_id, FRAMES // 2, every_s=0.5)
        before = used_s()
        _, there = done_at(farm.database, job_id, 5 * FRAMES // 2, every_s=0.5)
        after = used_s()
    worker.kill()
    broker.kill()
    spent = [(late - early) / (there - begun) for early, late in zip(before, after, strict=True)]
    return Shares(*spent), (_database_bytes(url) - empty) / (3 * FRAMES)


def _broker_memory(folder: Path) -> Iterator[Row]:
    broker = Broker(folder)
    count, client = 2_000, broker.client
    order = Order(kind=TaskKind.RENDER, job_id="j" * 18, task_id="j" * 18 + "-1", attempt="a" * 26, attempt_number=1)
    queue = OrderQueue(broker.url, seals=seals_in(folder), timeout_s=60.0)
    before = client.info("memory")["used_memory"]
    for _ in range(count // 100):
        queue.publish([order] * 100)
    held = (client.info("memory")["used_memory"] - before) / count
    queue.close()
    broker.kill()
    yield Row("Valkey: memory of an order that waits for a worker", f"{held:,.0f} bytes")


def _stores(folder: Path) -> Iterator[Row]:
    data = np.random.default_rng(1).bytes(OBJECT_BYTES)
    path = folder / "object"
    path.write_bytes(data)
    disk = LocalStore(folder / "disk")
    disk.make_identity()
    with running_object_store() as server:
        bucket = S3Store(
            server.new_bucket(), copies=folder / "copies", prefix="farm", endpoint=server.endpoint, region=""
        )
        bucket.make_identity()
        for name, store in (("disk", disk), ("bucket on loopback (SeaweedFS)", bucket)):
            begun_s, spent_s = time.monotonic(), _store_cpu_s(server)
            for number in range(OBJECTS):
                store.put_file(f"jobs/j/{number}", path)
            put_s = time.monotonic() - begun_s
            begun_s = time.monotonic()
            for number in range(OBJECTS):
                with store.local_path(f"jobs/j/{number}") as found:
                    assert len(found.read_bytes()) == OBJECT_BYTES
            get_s = time.monotonic() - begun_s
            megabytes = OBJECTS * OBJECT_BYTES / 1e6
            yield Row(
                f"{name}: written and read, by one slot", f"{megabytes / put_s:,.0f} and {megabytes / get_s:,.0f} MB/s"
            )
        cost = (_store_cpu_s(server) - spent_s) / (2 * megabytes)
        yield Row("SeaweedFS: CPU of a megabyte, and MB/s by one core", f"{1e3 * cost:.2f} ms, {1 / cost:,.0f} MB/s")


def _video(folder: Path) -> Iterator[Row]:
    """Yield the cost of a frame of each engine, and of a feature-length video of such frames."""
    for title, scene in (("POV-Ray", "fish"), ("Mitsuba", "fish-mesh")):
        yield from _video_of(folder / scene, title, scene)


def _video_of(folder: Path, title: str, scene: str) -> Iterator[Row]:
    rig = {"lens_array": {"count": [LENSES, LENSES]}}
    spec = parse_spec({"scene": scene, "frames": "1-2", "rig": rig, "render": {"cache": False}})
    with farm_up(folder, slots=2) as farm:
        job = ended(farm.client, farm.client.submit(spec).id, within_s=3600)
        assert job.status == "done", job.error
        cpu_s = dict.fromkeys(TaskKind, 0.0)
        for task in farm.client.tasks(job.id):
            cpu_s[TaskKind(task.kind)] += (task.cpu_s or 0.0) / len(spec.frame_numbers)
        kept = farm.data_dir / "artifacts" / names.job_artifact(job.id, "")
        bytes_a_frame = sum(path.stat().st_size for path in kept.rglob("*") if path.is_file()) / len(spec.frame_numbers)
    render_s, assemble_s, encode_s = (cpu_s[kind] for kind in (TaskKind.RENDER, TaskKind.ASSEMBLE, TaskKind.ENCODE))
    yield Row(
        f"{title}, a frame of 2400 x 2400 px of the fish: CPU of rendering, of assembly, of its part of three videos",
        f"{render_s:.1f} s, {assemble_s:.1f} s, {encode_s:.1f} s",
    )
    yield Row(f"the same by {title}: bytes that are kept", f"{bytes_a_frame / 1e6:.0f} MB")
    core_hours = VIDEO_FRAMES * (render_s + assemble_s + encode_s) / 3600
    slots = core_hours / (7 * 24)
    video = f"{MINUTES} min of {FPS} frames/s ({VIDEO_FRAMES:,} frames) by {title}"
    yield Row(f"{video}: core hours, and cores for a week", f"{core_hours:,.0f} h, {slots:,.0f}")
    yield Row(f"{video}: bytes that are kept", f"{VIDEO_FRAMES * bytes_a_frame / 1e12:.1f} TB")
    seconds = 7 * 86_400
    yield Row(f"{video} in a week: tasks a second", f"{2 * VIDEO_FRAMES / seconds:.2f}")
    yield Row(f"{video} in a week: written to the store", f"{VIDEO_FRAMES * bytes_a_frame / 1e6 / seconds:.0f} MB/s")
    yield Row(
        f"{video}: the three videos, which one slot each encodes", f"{VIDEO_FRAMES * encode_s / 3600:,.0f} h of CPU"
    )


def _postmaster(url: str) -> int:
    """Return the process id of the PostgreSQL server."""
    with psycopg.connect(url.replace("+psycopg", "")) as connection:
        row = connection.execute("SHOW data_directory").fetchone()
    assert row is not None
    return int(Path(row[0], "postmaster.pid").read_text().split()[0])


def _database_bytes(url: str) -> int:
    with psycopg.connect(url.replace("+psycopg", "")) as connection:
        row = connection.execute("SELECT pg_database_size(current_database())").fetchone()
    assert row is not None
    return int(row[0])


def _store_cpu_s(server: ObjectStore) -> float:
    assert server.process is not None
    return _cpu_s(server.process.pid)


def _cpu_s(pid: int) -> float:
    """Return the CPU time of a process, of those below it and of its children that have ended, s."""
    ticks = 0
    for each in (pid, *descendants(pid)):
        fields = Path(f"/proc/{each}/stat").read_text().rpartition(")")[2].split()
        ticks += sum(int(field) for field in fields[11 : 15 if each == pid else 13])
    return ticks / TICKS


if __name__ == "__main__":
    sys.exit(main())
