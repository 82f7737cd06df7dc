"""Queries on the workers that are drained or excluded.

A drain is of one start of a worker process, so a restart ends it. An exclusion is of a name, and lasts.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

from sqlalchemy import delete, select
from sqlalchemy.orm import Session

from service.db.engine import changed
from service.db.tables import Drain, Exclusion


def drains(session: Session) -> dict[str, bool]:
    """Return the worker processes that are drained, by instance; true for those that end afterwards."""
    return {row.instance: row.ends for row in session.execute(select(Drain.instance, Drain.ends))}


def set_drain(session: Session, worker: str, instance: str, *, ends: bool, now_s: float) -> None:
    """Drain a worker process, and forget drains of earlier processes of the same name."""
    changed(session, delete(Drain).where(Drain.worker == worker, Drain.instance != instance))
    session.merge(Drain(instance=instance, worker=worker, ends=ends, since_s=now_s))


def drained_before(session: Session, until_s: float) -> set[str]:
    """Return the worker processes that were drained before a time, by instance."""
    return {*session.scalars(select(Drain.instance).where(Drain.since_s < until_s))}


def delete_drains(session: Session, instances: Collection[str]) -> None:
    """Forget the drains of some worker processes."""
    changed(session, delete(Drain).where(Drain.instance.in_(instances)))


def delete_drain(session: Session, worker: str) -> bool:
    """Let a worker take orders again; return False if it was not drained."""
    return bool(changed(session, delete(Drain).where(Drain.worker == worker)))


def exclusions(session: Session) -> Sequence[Exclusion]:
    """Return the exclusions of workers, sorted by the names of the workers."""
    return session.scalars(select(Exclusion).order_by(Exclusion.worker)).all()


def exclude(session: Session, worker: str, *, name: str, now_s: float) -> None:
    """Exclude a worker; one that is excluded already stays so since then."""
    if session.get(Exclusion, worker) is None:
        session.add(Exclusion(worker=worker, name=name, since_s=now_s))
        session.flush()


def include(session: Session, worker: str) -> bool:
    """Include a worker again; return False if it was not excluded."""
    return bool(changed(session, delete(Exclusion).where(Exclusion.worker == worker)))
