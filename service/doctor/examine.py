"""All checks in order, and the repair of what they found."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from sqlalchemy import Connection
from sqlalchemy.exc import DatabaseError, OperationalError
from sqlalchemy.orm import Session

from lippmann.plan.artifact_store import ArtifactStore
from service.db.engine import Database
from service.doctor.farm_checks import check_farm
from service.doctor.finding import Check, Finding, Level
from service.doctor.job_checks import check_jobs
from service.doctor.repair import repair_artifacts, repair_rows, repair_store
from service.doctor.schema import check_integrity, check_schema
from service.doctor.settings import check_settings
from service.doctor.store import check_store
from service.doctor.task_checks import check_attempts, check_dependents, check_domains, check_held
from service.doctor.usage_checks import check_usage
from service.settings import Settings

_UNREADABLE = frozenset({Check.INTEGRITY, Check.FOREIGN_KEYS, Check.SCHEMA, Check.STATUS_DOMAIN})
"""The checks whose findings prevent any further examination."""


@dataclass(frozen=True)
class Patient:
    """A farm that is examined."""

    database: Database
    store: ArtifactStore
    settings: Settings


@dataclass(frozen=True)
class Diagnosis:
    """The findings, and the repairs."""

    findings: tuple[Finding, ...]
    """The findings now, after the repair if there was one."""
    repaired: tuple[Finding, ...] = ()
    """The findings of before the repair that are gone."""

    @property
    def is_healthy(self) -> bool:
        """True if nothing is wrong now; notes do not count."""
        return not any(finding.is_bad for finding in self.findings)


def examine(patient: Patient, *, now_s: float, by_content: bool = False) -> tuple[Finding, ...]:
    """Return everything that is wrong with a farm; this writes nothing.

    Parameters
    ----------
    by_content
        True to read every artifact and compare its digest; False to compare sizes only.
    """
    found = list(check_settings(patient.settings))
    try:
        rows = _examine_database(patient, now_s)
    except OperationalError:
        raise  # The database does not answer, which is no damage.
    except DatabaseError as error:
        return (*found, Finding(Check.INTEGRITY, Level.ERROR, f"the database cannot be read: {error.orig}"))
    found += rows
    if not any(finding.check in _UNREADABLE for finding in rows):
        found += check_store(patient.database, patient.store, by_content=by_content, now_s=now_s)
    return tuple(found)


def examine_and_repair(patient: Patient, *, clock: Callable[[], float], by_content: bool = False) -> Diagnosis:
    """Examine a farm, repair what can be repaired, and examine it again.

    Parameters
    ----------
    clock
        Returns the seconds since 1970. It is read anew for each part, since to examine the store may take hours.
    """
    before = examine(patient, now_s=clock(), by_content=by_content)
    checks = {finding.check for finding in before if finding.repairable}
    if not checks:
        return Diagnosis(before)
    repair_rows(patient.database, patient.settings, checks, clock=clock)
    repair_store(patient.database, patient.store, checks, now_s=clock())
    repair_artifacts(patient.database, patient.store, before)
    after = examine(patient, now_s=clock(), by_content=by_content)
    left = {(finding.check, finding.job_id) for finding in after}
    gone = tuple(finding for finding in before if (finding.check, finding.job_id) not in left)
    return Diagnosis(after, repaired=gone)


def _examine_database(patient: Patient, now_s: float) -> list[Finding]:
    # All queries see one moment, so that no task is seen between two places.
    with patient.database.snapshot() as connection:
        found = list(check_integrity(connection)) or list(check_schema(connection))
        return found or list(_check_rows(connection, patient.settings, now_s))


def _check_rows(connection: Connection, settings: Settings, now_s: float) -> Iterator[Finding]:
    with Session(connection) as session:
        domains = list(check_domains(session))
        yield from domains
        if domains:
            return  # Rows with such values cannot be read.
        yield from check_held(session)
        yield from check_attempts(session)
        yield from check_dependents(session)
        yield from check_jobs(session, settings)
        yield from check_usage(session)
        yield from check_farm(session, settings, now_s=now_s)
