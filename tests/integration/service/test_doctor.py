"""The doctor finds nothing in a farm that works, finds every invariant that is broken by hand, and repairs it."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import text

from lippmann.job.messages.orders import TaskKind
from lippmann.job.states import JobStatus, TaskStatus
from lippmann.plan import artifact_names as names
from service.coordinator.orphan_sweeper import ORPHAN_S
from service.db import coordinator as coordinator_rows
from service.db.engine import Database
from service.db.migrations import migrate
from service.doctor.examine import Patient, examine, examine_and_repair
from service.doctor.farm_checks import STOP_S
from service.doctor.finding import Check, Finding, Level
from service.doctor.settings import check_settings
from service.doctor.store import PARTIAL_S, check_store
from service.ids import new_job_id
from service.jobs.commands import cancel_job, pause_job, resume_job, retry_job
from service.jobs.verification import expected_artifacts
from service.settings import Settings
from service.store_identity import adopt_store
from tests.builders_service import T0, Farm, claimed, done, failed, heartbeat
from worker.store.local import LocalStore


@pytest.fixture
def farm(url: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Farm]:
    monkeypatch.setattr(coordinator_rows, "clock_s", lambda _session, *, local_s: local_s)
    farm = Farm(url, data_dir=tmp_path)
    yield farm
    farm.database.dispose()


def patient_of(farm: Farm) -> Patient:
    return Patient(farm.database, farm.store, farm.settings)


def found(farm: Farm, **how: Any) -> list[Finding]:
    """Return what the doctor finds, after the artifacts of all done tasks were stored."""
    store_artifacts(farm)
    return [*examine(patient_of(farm), now_s=farm.now_s, **how)]


def store_artifacts(farm: Farm) -> None:
    with farm.database.reading() as session:
        job_ids = [row[0] for row in session.execute(text("SELECT id FROM jobs"))]
    for job_id in job_ids:
        spec = farm.job(job_id).parsed_spec
        for task in farm.tasks(job_id):
            if task.status is TaskStatus.DONE:
                with farm.database.reading() as session:
                    session.add(task)
                    for name in expected_artifacts(spec, task):
                        full_name = names.job_artifact(job_id, name)
                        if not farm.store.exists(full_name):
                            farm.store.put_bytes(full_name, b"light")


def sql(farm: Farm, statement: str, **values: Any) -> None:
    with farm.writing() as session:
        session.execute(text(statement), values)


def in_mid_job(farm: Farm) -> str:
    """Bring a job to its middle: frame 1 is done, tile 0 of frame 3 is done, tile 1 runs, and others are dispatched.

    The frames are rendered in the order 1, 3, 4, 2.
    """
    job_id = farm.planned(frames="1-4")
    running = None
    while running is None:
        for order in farm.dispatch():
            if order.frame == 3 and order.tile is not None and order.tile.row == 1:
                running = order
                farm.say(claimed(order), heartbeat(order))
            elif running is None:
                farm.say(claimed(order), done(order))
    farm.dispatch()
    return job_id


def test_nothing_is_wrong_at_any_time_in_the_life_of_a_job(farm: Farm) -> None:
    assert found(farm) == []
    job_id = farm.submit()
    assert found(farm) == []
    (probe,) = farm.dispatch()
    assert found(farm) == []
    farm.say(claimed(probe))
    assert found(farm) == []
    farm.say(done(probe))
    assert found(farm) == []
    farm.plan()
    first, second, *_ = farm.dispatch()
    assert found(farm) == []
    farm.say(claimed(first), done(first), claimed(second), failed(second))
    assert found(farm) == []
    with farm.writing() as session:
        pause_job(session, job_id, now_s=farm.now_s)
    assert found(farm) == []
    with farm.writing() as session:
        resume_job(session, job_id, now_s=farm.now_s, limit=farm.settings.failure_limit)
    farm.dispatch()
    with farm.writing() as session:
        cancel_job(session, job_id, now_s=farm.now_s)
    assert found(farm) == []
    with farm.writing() as session:
        retry_job(session, job_id, now_s=farm.now_s, limit=farm.settings.failure_limit)
    assert found(farm) == []
    farm.work()
    assert farm.job(job_id).status is JobStatus.DONE
    assert found(farm, by_content=True) == []


BROKEN: dict[str, tuple[Check, str]] = {
    "counters": (Check.COUNTERS, "UPDATE jobs SET waiting = waiting + 7, running = -1"),
    "progress": (Check.PROGRESS, "UPDATE jobs SET frames_done = 4, done_px = 1, total_px = 9"),
    "an attempt is missing": (Check.HELD_BY_NOBODY, "UPDATE tasks SET attempt = NULL WHERE status = 'dispatched'"),
    "a worker is missing": (Check.HELD_BY_NOBODY, "UPDATE tasks SET worker = NULL WHERE status = 'running'"),
    "two tasks have one attempt": (
        Check.HELD_TWICE,
        "UPDATE tasks SET attempt = 'same' WHERE status IN ('running', 'dispatched')",
    ),
    "a dependent is stuck": (
        Check.STUCK,
        "UPDATE tasks SET status = 'waiting' WHERE kind = 'assemble' AND frame = 1",
    ),
    "a dependent is too early": (
        Check.TOO_EARLY,
        "UPDATE tasks SET status = 'ready' WHERE kind = 'assemble' AND frame = 4",
    ),
    "a dependent is dispatched too early": (
        Check.TOO_EARLY,
        "UPDATE tasks SET status = 'dispatched', attempt = 'a1' WHERE kind = 'encode'",
    ),
    "the bytes of a job": (Check.USAGE, "UPDATE jobs SET artifact_bytes = 7"),
    "the bytes of an owner": (Check.USAGE, "INSERT INTO owner_usage (owner_id, artifact_bytes) VALUES ('x', 7)"),
    "the plan was forgotten": (Check.UNPLANNED, "UPDATE jobs SET planned_s = NULL"),
    "the idle clock went back": (Check.IDLE_CLOCK, "UPDATE coordinator SET idle_s = -5"),
    "a clock was set": (Check.LEADER, "UPDATE coordinator SET leader = 'x', leader_until_s = 3e9"),
    "the coordinator's row is missing": (Check.COORDINATOR, "DELETE FROM coordinator"),
}


@pytest.mark.parametrize("what", BROKEN)
def test_what_is_broken_in_a_running_job_is_found_and_repaired_and_the_job_ends(farm: Farm, what: str) -> None:
    check, statement = BROKEN[what]
    job_id = in_mid_job(farm)
    assert found(farm) == []
    sql(farm, statement)
    before = found(farm)
    assert {finding.check for finding in before if finding.level is Level.ERROR} >= {check}
    assert all(finding.repairable for finding in before)
    diagnosis = examine_and_repair(patient_of(farm), clock=lambda: farm.now_s)
    assert (diagnosis.is_healthy, diagnosis.findings) == (True, ())
    assert check in {finding.check for finding in diagnosis.repaired}
    farm.plan()
    finish(farm)
    job = farm.job(job_id)
    assert (job.status, job.frames_done, job.done, job.done_px) == (JobStatus.DONE, 4, 14, job.total_px)
    assert found(farm) == []


def test_a_leader_that_lives_on_while_the_store_is_read_keeps_its_office_in_a_repair(
    farm: Farm, monkeypatch: pytest.MonkeyPatch
) -> None:
    def renew(now_s: float) -> None:
        sql(farm, f"UPDATE coordinator SET leader_until_s = {now_s + farm.settings.leader_ttl_s} WHERE leader = 'x'")

    in_mid_job(farm)
    store_artifacts(farm)
    sql(farm, "UPDATE coordinator SET idle_s = -5, leader = 'x'")
    renew(farm.now_s)
    folders = farm.store.folders

    def read_for_long() -> list[str]:
        farm.now_s += 600.0
        renew(farm.now_s)
        return folders()

    monkeypatch.setattr(farm.store, "folders", read_for_long)
    diagnosis = examine_and_repair(patient_of(farm), clock=lambda: farm.now_s)
    assert [finding for finding in diagnosis.findings if finding.check is Check.LEADER] == []
    assert Check.IDLE_CLOCK in {finding.check for finding in diagnosis.repaired}
    with farm.database.reading() as session:
        assert coordinator_rows.is_led_by(session, "x")


def finish(farm: Farm) -> None:
    """Do everything that is dispatched, held from before or ready."""
    with farm.database.reading() as session:
        held = session.execute(
            text("SELECT job_id, sequence, attempt FROM tasks WHERE status IN ('dispatched', 'running')")
        )
        attempts = {attempt for _, _, attempt in held}
    for order in [order for order in farm.queue.orders if order.attempt in attempts]:
        farm.say(claimed(order), done(order))
    farm.work()


def test_a_held_task_of_an_ended_job_is_released(farm: Farm) -> None:
    job_id = in_mid_job(farm)
    sql(farm, "UPDATE jobs SET status = 'cancelled'")
    assert {finding.check for finding in found(farm)} == {Check.HELD_AFTER_END}
    assert examine_and_repair(patient_of(farm), clock=lambda: farm.now_s).is_healthy
    assert {task.status for task in farm.tasks(job_id)} & {TaskStatus.RUNNING, TaskStatus.DISPATCHED} == set()


def test_a_job_whose_tasks_have_ended_ends(farm: Farm) -> None:
    job_id = farm.planned()
    farm.work()
    sql(farm, "UPDATE jobs SET status = 'running'")
    assert {finding.check for finding in found(farm)} == {Check.NOT_ENDED}
    assert examine_and_repair(patient_of(farm), clock=lambda: farm.now_s).is_healthy
    assert farm.job(job_id).status is JobStatus.DONE


def test_a_probe_whose_measurements_are_missing_runs_again(farm: Farm) -> None:
    job_id = farm.submit()
    (order,) = farm.dispatch()
    farm.say(claimed(order), done(order))
    sql(farm, "UPDATE jobs SET probe = NULL, background_job = NULL")
    assert {finding.check for finding in found(farm)} == {Check.UNPLANNED}
    assert examine_and_repair(patient_of(farm), clock=lambda: farm.now_s).is_healthy
    for order in farm.dispatch():
        farm.say(claimed(order), done(order))
    farm.plan()
    farm.work()
    assert farm.job(job_id).status is JobStatus.DONE


UNREPAIRABLE: dict[str, tuple[Check, str]] = {
    "a status that is none": (Check.STATUS_DOMAIN, "UPDATE tasks SET status = 'lost' WHERE sequence = 3"),
    "a status of a job that is none": (Check.STATUS_DOMAIN, "UPDATE jobs SET status = 'gone'"),
    "a task is missing": (Check.PLAN, "DELETE FROM tasks WHERE sequence = 3"),
    "frames are missing": (Check.PLAN, "UPDATE jobs SET frames_total = 9"),
    "a done job is not done": (Check.DONE_INCOMPLETE, "UPDATE jobs SET status = 'done'"),
}


@pytest.mark.parametrize("what", UNREPAIRABLE)
def test_what_cannot_be_repaired_is_found(farm: Farm, what: str) -> None:
    check, statement = UNREPAIRABLE[what]
    in_mid_job(farm)
    store_artifacts(farm)
    sql(farm, statement)
    diagnosis = examine_and_repair(patient_of(farm), clock=lambda: farm.now_s)
    assert check in {finding.check for finding in diagnosis.findings if finding.level is Level.ERROR}
    assert not diagnosis.is_healthy


def test_a_row_that_refers_to_nothing_is_found_in_sqlite(tmp_path: Path) -> None:
    farm = Farm(f"sqlite:///{tmp_path}/test.db", data_dir=tmp_path)
    with farm.database.connecting() as connection:
        connection.connection.driver_connection.execute("COMMIT")  # type: ignore[union-attr]
        connection.connection.driver_connection.execute("PRAGMA foreign_keys=OFF")  # type: ignore[union-attr]
        connection.connection.driver_connection.execute("BEGIN IMMEDIATE")  # type: ignore[union-attr]
        connection.execute(text("INSERT INTO worker_faults (job_id, worker, failures) VALUES ('none', 'w', 1)"))
    assert [finding.check for finding in found(farm)] == [Check.FOREIGN_KEYS]
    farm.database.dispose()


def test_a_damaged_database_file_is_found(tmp_path: Path) -> None:
    farm = Farm(f"sqlite:///{tmp_path}/test.db", data_dir=tmp_path)
    farm.planned(frames="1-400")
    farm.database.checkpoint()
    farm.database.dispose()
    path = tmp_path / "test.db"
    data = bytearray(path.read_bytes())
    for page in range(len(data) // 4096 - 20, len(data) // 4096 - 10):
        data[page * 4096 : page * 4096 + 64] = bytes(64)
    path.write_bytes(data)
    database = Database(f"sqlite:///{path}")
    findings = examine(Patient(database, farm.store, farm.settings), now_s=T0)
    assert findings[0].check is Check.INTEGRITY
    database.dispose()


@pytest.mark.parametrize(("revision", "level"), [("0003", Level.WARNING), ("9999", Level.ERROR)])
def test_another_schema_is_found_and_nothing_else_is_examined(farm: Farm, revision: str, level: Level) -> None:
    sql(farm, "UPDATE alembic_version SET version_num = :revision", revision=revision)
    (finding,) = examine(patient_of(farm), now_s=farm.now_s)
    assert (finding.check, finding.level) == (Check.SCHEMA, level)


def test_attempts_that_are_silent_while_a_leader_is_alive_are_a_warning(farm: Farm) -> None:
    in_mid_job(farm)
    farm.now_s += 1000
    assert found(farm) == []
    sql(farm, "UPDATE coordinator SET leader = 'x', leader_until_s = :until_s", until_s=farm.now_s + 5)
    assert [(one.check, one.level) for one in found(farm)] == [(Check.SILENT, Level.WARNING)]


def test_stop_requests_that_stay_while_a_leader_is_alive_are_a_warning(farm: Farm) -> None:
    sql(farm, "INSERT INTO stop_requests (attempt, requested_s) VALUES ('a', :at_s)", at_s=T0 - STOP_S - 1)
    sql(farm, "UPDATE coordinator SET leader = 'x', leader_until_s = :until_s", until_s=T0 + 5)
    assert [(one.check, one.level) for one in found(farm)] == [(Check.STOPS, Level.WARNING)]


def _remove(farm: Farm, name: str) -> None:
    del farm.store.files[name]


def _cut(farm: Farm, name: str) -> None:
    farm.store.files[name] = b""


@pytest.mark.parametrize("damage", [_remove, _cut])
def test_a_missing_and_a_damaged_artifact_are_found(farm: Farm, damage: Callable[[Farm, str], None]) -> None:
    job_id = farm.planned()
    farm.work()
    store_artifacts(farm)
    damage(farm, names.job_artifact(job_id, "orthoscopic/0002.exr"))
    (finding,) = examine(patient_of(farm), now_s=farm.now_s)
    assert (finding.check, finding.job_id, len(finding.sequences)) == (Check.ARTIFACTS, job_id, 1)
    assert "orthoscopic/0002.exr" in finding.message


def test_a_changed_artifact_is_found_when_the_content_is_read(farm: Farm) -> None:
    job_id = farm.planned()
    farm.work()
    store_artifacts(farm)
    digests = '{"thumbs/0001.webp": [5, "' + "0" * 64 + '"]}'
    sql(farm, "UPDATE tasks SET digests = :digests WHERE kind = 'assemble' AND frame = 1", digests=digests)
    assert examine(patient_of(farm), now_s=farm.now_s) == ()
    (finding,) = examine(patient_of(farm), now_s=farm.now_s, by_content=True)
    assert (finding.check, finding.job_id) == (Check.ARTIFACTS, job_id)


@pytest.mark.parametrize("damage", [_remove, _cut])
def test_a_repair_lets_the_farm_make_damaged_artifacts_of_a_done_job_again(
    farm: Farm, damage: Callable[[Farm, str], None]
) -> None:
    job_id, whole = farm.planned_jobs(2)
    farm.work()
    store_artifacts(farm)
    for name in ("orthoscopic/0002.exr", "tiles/0003/01-00.exr"):
        damage(farm, names.job_artifact(job_id, name))
    diagnosis = examine_and_repair(patient_of(farm), clock=lambda: farm.now_s)
    assert (diagnosis.findings, [one.check for one in diagnosis.repaired]) == ((), [Check.ARTIFACTS])
    again = [(task.kind, task.frame) for task in farm.tasks(job_id) if task.status is TaskStatus.READY]
    assert again == [(TaskKind.ASSEMBLE, 2), (TaskKind.RENDER, 3)]
    assert (farm.job(job_id).status, farm.job(whole).status) == (JobStatus.RUNNING, JobStatus.DONE)
    assert farm.work() == 2
    assert found(farm) == []
    assert farm.job(job_id).status is JobStatus.DONE


def test_a_repair_leaves_a_failed_job_as_it_is_and_says_what_repairs_it(farm: Farm) -> None:
    job_id = farm.planned()
    order, *others = farm.dispatch()
    farm.say(*(said for each in others for said in (claimed(each), done(each))))
    farm.say(claimed(order), failed(order, permanent=True))
    assert farm.job(job_id).status is JobStatus.FAILED
    store_artifacts(farm)
    del farm.store.files[names.job_artifact(job_id, "tiles/0001/01-00.exr")]
    (finding,) = examine_and_repair(patient_of(farm), clock=lambda: farm.now_s).findings
    assert (finding.check, finding.repairable) == (Check.ARTIFACTS, False)
    assert f"the job is failed, and `lippmann repair {job_id}` makes them again" in finding.message


def test_a_missing_bundle_is_found(farm: Farm) -> None:
    farm.store.files.clear()
    (finding,) = examine(patient_of(farm), now_s=farm.now_s)
    assert (finding.check, finding.level, "ball" in finding.message) == (Check.BUNDLES, Level.WARNING, True)


def test_what_removed_jobs_left_is_swept_and_what_a_lost_database_left_is_kept(farm: Farm) -> None:
    left, kept = new_job_id(T0), new_job_id(T0 + 1)
    farm.store.put_bytes(f"{left}/log/probe/1.txt", b"late")
    farm.store.put_bytes(f"{kept}/{names.JOB_FILE}", b"{}")
    assert [(one.check, one.level) for one in found(farm)] == [(Check.ORPHANS, Level.NOTE)]
    farm.now_s += ORPHAN_S + 1
    assert sorted(one.level for one in found(farm)) == [Level.NOTE, Level.WARNING]
    diagnosis = examine_and_repair(patient_of(farm), clock=lambda: farm.now_s)
    assert (diagnosis.is_healthy, [one.level for one in diagnosis.findings]) == (True, [Level.NOTE])
    assert farm.store.folders() == [kept, "scenes"]


def test_partial_files_of_dead_processes_are_removed(farm: Farm, tmp_path: Path) -> None:
    store = LocalStore(tmp_path / "store")
    for name, data in farm.store.files.items():
        store.put_bytes(name, data)
    patient = Patient(farm.database, store, farm.settings)
    partial = tmp_path / "store" / ".partial" / "0123"
    partial.touch()
    assert examine(patient, now_s=farm.now_s) == ()
    old_s = partial.stat().st_mtime - PARTIAL_S - 60
    os.utime(partial, (old_s, old_s))
    assert [finding.check for finding in examine(patient, now_s=farm.now_s)] == [Check.PARTIAL_FILES]
    assert examine_and_repair(patient, clock=lambda: farm.now_s).is_healthy
    assert not partial.exists()


def test_an_empty_folder_in_the_place_of_the_store_is_found_and_no_artifact_is_missing(
    farm: Farm, tmp_path: Path
) -> None:
    farm.planned()
    farm.work()
    adopt_store(farm.database, LocalStore(tmp_path / "store"))
    (finding,) = examine(Patient(farm.database, LocalStore(tmp_path / "empty"), farm.settings), now_s=farm.now_s)
    assert (finding.check, finding.repairable, "--adopt-store" in finding.message) == (Check.STORE, False, True)


@pytest.mark.parametrize(("free", "level"), [(50_000_000, Level.ERROR), (500_000_000, Level.WARNING)])
def test_little_space_is_found(tmp_path: Path, free: int, level: Level) -> None:
    class Small(LocalStore):
        def free_bytes(self) -> int:
            return free

    database = Database(f"sqlite:///{tmp_path}/test.db")
    migrate(database)
    (finding,) = check_store(database, Small(tmp_path / "store"), by_content=False, now_s=T0)
    assert (finding.check, finding.level) == (Check.SPACE, level)
    database.dispose()


@pytest.mark.parametrize(
    ("settings", "name"),
    [
        ({"lease_ttl_s": 5.0}, "LEASE_TTL_S"),
        ({"reconcile_s": 100.0}, "RECONCILE_S"),
        ({"public_url": "farm.example"}, "PUBLIC_URL"),
        ({"database_url": "postgresql+psycopg://x@y/z"}, "DATABASE_URL"),
        ({"webhook_url": "http://hooks.example"}, "WEBHOOK_URL"),
    ],
)
def test_settings_that_contradict_are_found(tmp_path: Path, settings: dict[str, Any], name: str) -> None:
    (tmp_path / "lippmann.db").touch()
    assert list(check_settings(Settings(data_dir=tmp_path))) == []
    (finding,) = check_settings(Settings(data_dir=tmp_path, **settings))
    assert (finding.check, name in finding.message) == (Check.SETTINGS, True)
