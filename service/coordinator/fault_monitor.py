"""The fault monitor pauses jobs while something outside them prevents their work, and lets them go on afterwards.

A fault of the farm (the store, the disk of the database, the broker's append-only file, or the disks of all workers)
pauses every job whose work has begun; nothing of a queued job is dispatched meanwhile. Jobs go on when all faults have
gone. If something prevents the work of one job on every worker that could do it, this job alone is paused, until it may
be tried on some worker again.
"""

from __future__ import annotations

import threading
from collections import defaultdict
from collections.abc import Iterator, Sequence

import structlog
from sqlalchemy.exc import DBAPIError

from lippmann.job.messages.events import Presence
from service.broker_stream import Stream, evicting_text
from service.claiming import fitting, is_able
from service.db import coordinator as coordinator_rows
from service.db import jobs as job_rows
from service.db import tasks as task_rows
from service.db.engine import Database
from service.db.reserve import is_full
from service.db.tables import WorkerFault
from service.errors import BrokerUnavailable, NotLeading
from service.jobs.farm_pause import pause_for_farm, resume_for_farm
from service.schemas.farm import Fault
from service.settings import Settings
from service.store_check import StoreCheck

FIRST_CHECK_S = 1.0
"""The time until a fault is checked again; it doubles up to `store_check_s`."""
DATABASE_FULL = "database-full"
DATABASE_UNAVAILABLE = "database-unavailable"
BROKER_FULL = "broker-full"
BROKER_EVICTS = "broker-evicts"

log = structlog.get_logger("service.fault_monitor")


class FaultMonitor:
    """Finds the faults of the farm, and pauses and resumes jobs."""

    def __init__(self, database: Database, stream: Stream, store_check: StoreCheck, settings: Settings) -> None:
        self._database = database
        self._stream = stream
        self._store_check = store_check
        self._settings = settings
        self._faults: tuple[Fault, ...] = ()
        self._has_read = False
        self._poked = threading.Event()
        self._next_s = float("-inf")
        self._pause_s = FIRST_CHECK_S
        self._told_of_restarts = False

    @property
    def faults(self) -> tuple[Fault, ...]:
        """The causes that prevent all work of the farm, first cause first; nothing is dispatched meanwhile."""
        return self._faults

    def begin(self) -> None:
        """Continue with the faults that another leader found, which this process does not know."""
        self._has_read = False

    def poke(self) -> None:
        """Check in the next round, because something failed."""
        self._poked.set()

    def run(self, workers: Sequence[Presence], *, now_s: float) -> None:
        """Check what is due, then pause and resume jobs; a clock that was set back delays no check."""
        known = self._known()
        if self._is_due(known, now_s):
            found = self._merged(known, tuple(self._find(workers, now_s)))
            self._next_s = now_s + self._pause(bool(found), known == found)
            if found != known:
                log.warning("faults", faults=[f"{fault.component}: {fault.message}" for fault in found])
            self._faults = found  # known here even if the database cannot record it
            self._follow(known, found, now_s)
        if not self.faults:
            self._pause_where_no_worker_can_work(workers, now_s)

    def _known(self) -> tuple[Fault, ...]:
        if not self._has_read:
            with self._database.reading() as session:
                stored = coordinator_rows.faults(session)
            known = {(fault.component, fault.code) for fault in stored}
            own = (fault for fault in self._faults if (fault.component, fault.code) not in known)
            self._faults = (*stored, *own)
            self._has_read = True
        return self._faults

    def _is_due(self, known: Sequence[Fault], now_s: float) -> bool:
        if self._poked.is_set() or not 0 < self._next_s - now_s <= self._settings.store_check_s:
            self._poked.clear()
            return True
        if not known:
            return False
        with self._database.reading() as session:
            return bool(job_rows.workable_ids(session))  # a user has resumed one: try again

    def _pause(self, has_faults: bool, is_same: bool) -> float:
        if not has_faults:
            return self._settings.store_check_s
        self._pause_s = 2 * self._pause_s if is_same else FIRST_CHECK_S
        self._pause_s = min(self._pause_s, self._settings.store_check_s)
        return self._pause_s

    def _find(self, workers: Sequence[Presence], now_s: float) -> Iterator[Fault]:
        error = self._store_check.error()
        if error is not None:
            yield Fault(component="store", code=error.code, message=error.message, since_s=now_s)
        for component, find in (("database", self._database_fault), ("broker", self._broker_fault)):
            found = find()
            if found is not None:
                yield Fault.model_validate(
                    {"component": component, "code": found[0], "message": found[1], "since_s": now_s}
                )
        faults = [(worker.name, worker.fault) for worker in workers]
        name, first = faults[0] if faults else ("", None)
        if first is not None and all(fault for _, fault in faults):
            message = f"No worker can work; {name}: {first.message}."
            yield Fault(component="workers", code=first.code, message=message, since_s=now_s)

    def _database_fault(self) -> tuple[str, str] | None:
        full = DATABASE_FULL, "The disk of the database has no room left."
        try:
            with self._database.writing() as session:
                coordinator_rows.add_idle(session, 0.0)
            return None if self._database.reserve.keep() else full
        except NotLeading:
            return None  # it has begun a write transaction
        except DBAPIError as error:
            if is_full(error):
                return full
            return DATABASE_UNAVAILABLE, f"The database cannot be written: {error.orig}."
        except OSError as error:
            return DATABASE_UNAVAILABLE, f"The folder of the database cannot be written: {error.strerror}."

    def _broker_fault(self) -> tuple[str, str] | None:
        reason = self._stream.write_error()
        if reason is not None:
            return BROKER_FULL, f"The broker cannot write its append-only file: {reason}."
        try:
            keeping = self._stream.keeping()
        except BrokerUnavailable:
            return None  # it does not answer at all, which is another matter
        if keeping is not None and not keeping.has_append_only_file and not self._told_of_restarts:
            self._told_of_restarts = True
            log.warning("the broker has no append-only file: orders that a restart of it loses are sent again")
        if keeping is not None and keeping.evicts:
            return BROKER_EVICTS, evicting_text(keeping.evicts)
        return None

    def _merged(self, known: Sequence[Fault], found: Sequence[Fault]) -> tuple[Fault, ...]:
        """Return the faults in the order in which they began; one that lasts keeps its time and its sentence."""
        lasting = {(fault.component, fault.code): fault for fault in known}
        faults = [lasting.get((fault.component, fault.code), fault) for fault in found]
        return tuple(sorted(faults, key=lambda fault: fault.since_s))

    def _follow(self, known: Sequence[Fault], found: Sequence[Fault], now_s: float) -> None:
        if found:
            self._pause_jobs(found[0], now_s)
        elif known:
            self._resume_jobs(now_s)
        if found != known:
            # Written last: if this process ends before, the next leader still finds the jobs to resume.
            with self._database.writing() as session:
                coordinator_rows.set_faults(session, found)

    def _pause_jobs(self, cause: Fault, now_s: float) -> None:
        with self._database.reading() as session:
            paused = job_rows.paused_by_farm(session)
            job_ids = [*job_rows.workable_ids(session), *(each for each in paused if paused[each] != cause.message)]
        for job_id in job_ids:
            self._pause_job(job_id, cause.code, cause.message, now_s)

    def _pause_job(self, job_id: str, code: str, reason: str, now_s: float) -> None:
        with self._database.writing() as session:
            row = job_rows.job(session, job_id)
            if row is not None and row.status in job_rows.BEGUN:
                pause_for_farm(session, row, code=code, reason=reason, now_s=now_s)

    def _resume_jobs(self, now_s: float) -> None:
        with self._database.reading() as session:
            job_ids = job_rows.paused_by_farm(session)
        for job_id in job_ids:
            self._resume_job(job_id, is_repaired=True, now_s=now_s)

    def _resume_job(self, job_id: str, *, is_repaired: bool, now_s: float) -> None:
        with self._database.writing() as session:
            row = job_rows.job(session, job_id)
            if row is not None:
                limit = self._settings.failure_limit
                resume_for_farm(session, row, is_repaired=is_repaired, now_s=now_s, limit=limit)

    def _pause_where_no_worker_can_work(self, workers: Sequence[Presence], now_s: float) -> None:
        """Pause the jobs that every worker which could do them prevents, and resume those that some may try."""
        with self._database.reading() as session:
            paused = job_rows.paused_by_farm(session)
            prevented: dict[str, list[WorkerFault]] = defaultdict(list)
            for fault in task_rows.prevented_workers(session, now_s=now_s):
                prevented[fault.job_id].append(fault)
            asked = job_rows.requirements_of(session, prevented)
        for job_id, faults in prevented.items():
            able = {worker.name for worker in fitting(workers, asked.get(job_id, "")) if is_able(worker)}
            if able and able <= {fault.worker for fault in faults}:
                cause = max(faults, key=lambda fault: fault.avoided_until_s or 0.0)
                reason = f"No worker can do its work; {cause.worker}: {cause.message}"
                if paused.pop(job_id, None) != reason:
                    self._pause_job(job_id, cause.code or "", reason, now_s)
        for job_id in paused:
            self._resume_job(job_id, is_repaired=False, now_s=now_s)
