"""Faults of the data folder: of artifacts, of scratch folders, of the store and of the database."""

from __future__ import annotations

import sqlite3
from contextlib import closing
from random import Random

from tests.chaos.kinds.kind import Injection, Kinds, pause
from tests.chaos.parts import Parts
from tests.damaging import DAMAGES, Damage
from tests.disks import away, read_only
from tests.waiting import until

KINDS = Kinds()


def _damaged(damage: Damage, pattern: str) -> Injection:
    def inject(parts: Parts, job_id: str, rng: Random) -> None:
        folder = parts.data_dir / "artifacts" / job_id
        files = until(lambda: sorted(folder.glob(pattern)), within_s=400.0)
        damage(rng.choice(files))

    return inject


for _damage in DAMAGES:
    KINDS.add(f"disk: a tile, {_damage.__name__}", _damaged(_damage, "**/tiles/**/*.exr"))
    KINDS.add(f"disk: a master, {_damage.__name__}", _damaged(_damage, "orthoscopic/*.exr"), damages=True)


@KINDS.of("disk: the scratch of a worker deleted")
def _scratch_deleted(parts: Parts, job_id: str, rng: Random) -> None:
    files = until(lambda: [path for path in (parts.data_dir / "scratch").rglob("*") if path.is_file()])
    for path in files:
        path.unlink(missing_ok=True)


@KINDS.of("disk: the store read-only for 10 s")
def _store_read_only(parts: Parts, job_id: str, rng: Random) -> None:
    with read_only(parts.data_dir / "artifacts"):
        pause(rng, 9.0, 11.0)


@KINDS.of("disk: the store away for 10 s")
def _store_away(parts: Parts, job_id: str, rng: Random) -> None:
    with away(parts.data_dir / "artifacts"):
        pause(rng, 9.0, 11.0)


@KINDS.of("database: locked by another process for 20 s")
def _locked(parts: Parts, job_id: str, rng: Random) -> None:
    with closing(sqlite3.connect(parts.data_dir / "lippmann.db", timeout=60.0, isolation_level=None)) as connection:
        connection.execute("BEGIN IMMEDIATE")
        pause(rng, 19.0, 21.0)
        connection.execute("ROLLBACK")
