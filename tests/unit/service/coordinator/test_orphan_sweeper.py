"""What nobody owns goes, and nothing else does."""

from __future__ import annotations

import time
from pathlib import Path

from service.coordinator.orphan_sweeper import ORPHAN_S, sweep_orphans
from service.ids import is_job_id, new_job_id
from service.jobs.commands import cancel_job, remove_job
from tests.builders_service import T0, Farm, claimed
from worker.store.local import LocalStore

DAY_S = 86_400.0


def _sweep(farm: Farm, now_s: float) -> int:
    return sweep_orphans(farm.database, farm.store, now_s=now_s)


def _end(farm: Farm, job_id: str) -> None:
    with farm.writing() as session:
        cancel_job(session, job_id, now_s=farm.now_s)
        remove_job(session, job_id)
    farm.plan()


def test_every_job_is_known_by_its_name_and_nothing_else_is() -> None:
    assert all(is_job_id(new_job_id(T0 + n)) for n in range(20))
    assert not [name for name in ("scenes", "", "backup-of-monday", "1q9gd6e00m0d73pe", "1q9gd6e00m0d73pexx",
                                  "1Q9GD6E00M0D73PEX", "1q9gd6e00m0d73pe\n") if is_job_id(name)]  # fmt: skip


def test_the_log_of_an_attempt_that_outlived_its_job_goes_after_an_hour(farm: Farm) -> None:
    job_id = farm.planned()
    order, *_ = farm.dispatch()
    farm.say(claimed(order))
    _end(farm, job_id)
    late = f"{job_id}/log/render-0001-00-00/1.txt"
    farm.store.put_bytes(late, b"told to stop")
    assert (_sweep(farm, T0 + ORPHAN_S - 1), late in farm.store.files) == (0, True)
    assert (_sweep(farm, T0 + ORPHAN_S + 1), late in farm.store.files) == (1, False)


def test_on_a_disk_too_only_what_nobody_owns_goes(farm: Farm, tmp_path: Path) -> None:
    store = LocalStore(tmp_path / "artifacts")
    orphan, owned, empty = new_job_id(T0), farm.submit(), new_job_id(T0 + 1)
    for name in (f"{orphan}/log/render-0001-00-00/1.txt", f"{owned}/job.json", "scenes/0a.zip"):
        store.put_bytes(name, b"x")
    (tmp_path / "artifacts" / empty).mkdir()
    assert sweep_orphans(farm.database, store, now_s=time.time() + ORPHAN_S / 2) == 0
    assert sweep_orphans(farm.database, store, now_s=time.time() + ORPHAN_S + 1) == 1
    assert [info.name for info in store.list("")] == [f"{owned}/job.json", "scenes/0a.zip"]
    assert store.folders() == sorted([owned, empty, "scenes"])


def test_one_young_artifact_keeps_the_folder(farm: Farm) -> None:
    job_id = new_job_id(T0)
    farm.store.files |= {f"{job_id}/log/1.txt": b"old", f"{job_id}/log/2.txt": b"young"}
    farm.store.written_s[f"{job_id}/log/2.txt"] = T0 + 3000
    assert _sweep(farm, T0 + ORPHAN_S + 1) == 0


def test_a_job_with_a_row_and_what_is_no_job_keep_everything(farm: Farm) -> None:
    kept_job, ended_job = farm.planned(), farm.submit()
    with farm.writing() as session:
        cancel_job(session, ended_job, now_s=farm.now_s)
    farm.store.files |= {f"{kept_job}/log/1.txt": b"x", "notes/of-the-state.txt": b"x"}
    before = dict(farm.store.files)
    assert _sweep(farm, T0 + 100 * DAY_S) == 0
    assert farm.store.files == before


def test_a_job_whose_row_was_lost_keeps_its_pictures(farm: Farm) -> None:
    job_id = new_job_id(T0)
    farm.store.files |= {f"{job_id}/job.json": b"{}", f"{job_id}/integral/0001.exr": b"hours of work"}
    assert _sweep(farm, T0 + 100 * DAY_S) == 0
    assert f"{job_id}/integral/0001.exr" in farm.store.files
