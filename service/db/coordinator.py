"""Leader, position in the stream, idle clock, attempts to stop."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from sqlalchemy import delete, or_, select, update
from sqlalchemy.orm import Session

from service.db.engine import changed
from service.db.tables import ClerkRow, StoppedAttempt


def clerk(session: Session) -> ClerkRow:
    """Return the one row as the database has it now."""
    return session.get_one(ClerkRow, 1, populate_existing=True)


def lead(session: Session, name: str, *, now_s: float, until_s: float) -> bool:
    """Become or stay the leader; False while another leads."""
    free = or_(ClerkRow.leader == name, ClerkRow.leader.is_(None), ClerkRow.until_s < now_s)
    return changed(session, update(ClerkRow).where(free).values(leader=name, until_s=until_s)) == 1


def step_down(session: Session, name: str) -> None:
    """Let another lead at once."""
    changed(session, update(ClerkRow).where(ClerkRow.leader == name).values(leader=None, until_s=0.0))


def advance(session: Session, was: str, to: str) -> bool:
    """Move the position in the stream; False if another moved it meanwhile."""
    return changed(session, update(ClerkRow).where(ClerkRow.position == was).values(position=to)) == 1


def rewind(session: Session) -> None:
    """Begin a new stream at its beginning."""
    changed(session, update(ClerkRow).values(position="0-0"))


def add_idle(session: Session, seconds: float) -> float:
    """Advance the idle clock and return it."""
    changed(session, update(ClerkRow).values(idle_s=ClerkRow.idle_s + seconds))
    return clerk(session).idle_s


def stop(session: Session, attempts: Iterable[str | None], *, now_s: float) -> None:
    """Remember attempts that must hear that they should stop."""
    for attempt in attempts:
        if attempt is not None:
            session.merge(StoppedAttempt(attempt=attempt, at_s=now_s))
    session.flush()


def to_stop(session: Session, limit: int = 500) -> Sequence[str]:
    """Return attempts that have not heard yet."""
    return session.scalars(select(StoppedAttempt.attempt).order_by(StoppedAttempt.at_s).limit(limit)).all()


def stopped(session: Session, attempts: Sequence[str]) -> None:
    """Forget attempts that have heard."""
    changed(session, delete(StoppedAttempt).where(StoppedAttempt.attempt.in_(attempts)))
