"""Queries on the coordinator's row (leader election, stream position, idle clock) and on stop requests."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence

from sqlalchemy import bindparam, delete, or_, select, text, update
from sqlalchemy.orm import Session

from service.db.engine import changed
from service.db.tables import CoordinatorRow, StopRequest
from service.schemas.farm import Fault

_REQUEST_STOP = text(
    "INSERT INTO stop_requests (attempt, requested_s) VALUES (:attempt, :now_s) ON CONFLICT (attempt) DO NOTHING"
)


_ADVANCE = (
    update(CoordinatorRow)
    .where(CoordinatorRow.stream_position == bindparam("was"))
    .values(stream_position=bindparam("to"))
)
_LEADER = select(CoordinatorRow.leader)
_CLOCK = text("SELECT CAST(extract(epoch FROM clock_timestamp()) AS double precision)")
_POSITION = select(CoordinatorRow.stream_position)
_PENDING_STOPS = select(StopRequest.attempt).order_by(StopRequest.requested_s).limit(bindparam("limit"))


def stream_position(session: Session) -> str:
    """Return the position in the stream up to which events are written."""
    return session.scalars(_POSITION).one()


def current(session: Session) -> CoordinatorRow:
    """Return the single row as it is in the database now."""
    return session.get_one(CoordinatorRow, 1, populate_existing=True)


def clock_s(session: Session, *, local_s: float) -> float:
    """Return the time by the clock that all processes on this database share, s since 1970.

    It is that of PostgreSQL, because the clocks of several machines differ. The processes on an SQLite are on one
    machine, by whose clock it is `local_s`.
    """
    if session.get_bind().dialect.name == "sqlite":
        return local_s
    return float(session.scalars(_CLOCK).one())


def leader(session: Session, *, now_s: float) -> str | None:
    """Return the process that leads now; None if none does."""
    row = current(session)
    return row.leader if row.leader_until_s >= clock_s(session, local_s=now_s) else None


def is_led_by(session: Session, name: str) -> bool:
    """Return whether a process is the leader, or was it last."""
    return session.scalars(_LEADER).one() == name


def acquire_leadership(session: Session, name: str, *, now_s: float, until_s: float) -> bool:
    """Become or remain the leader until `until_s`; return False while another process leads."""
    free = or_(CoordinatorRow.leader == name, CoordinatorRow.leader.is_(None), CoordinatorRow.leader_until_s < now_s)
    return changed(session, update(CoordinatorRow).where(free).values(leader=name, leader_until_s=until_s)) == 1


def release_leadership(session: Session, name: str) -> None:
    """Allow another process to lead at once."""
    statement = update(CoordinatorRow).where(CoordinatorRow.leader == name)
    changed(session, statement.values(leader=None, leader_until_s=0.0))


def advance_position(session: Session, was: str, to: str) -> bool:
    """Advance the position in the stream; return False if another process advanced it in the meantime."""
    return changed(session, _ADVANCE, {"was": was, "to": to}) == 1


def reset_position(session: Session) -> None:
    """Set the position to the beginning of a new stream."""
    changed(session, update(CoordinatorRow).values(stream_position="0-0"))


def add_idle(session: Session, seconds: float) -> float:
    """Advance the idle clock and return it."""
    changed(session, update(CoordinatorRow).values(idle_s=CoordinatorRow.idle_s + seconds))
    return current(session).idle_s


def faults(session: Session) -> tuple[Fault, ...]:
    """Return what prevents all work of the farm now, first cause first."""
    return tuple(Fault.model_validate(fault) for fault in current(session).faults or ())


def set_faults(session: Session, found: Sequence[Fault]) -> None:
    """Store what prevents all work of the farm now."""
    values = [fault.model_dump(mode="json") for fault in found] or None
    changed(session, update(CoordinatorRow).values(faults=values))


def dropped(session: Session) -> Mapping[str, int]:
    """Return the number of messages of workers that the coordinators refused, by their kind."""
    return current(session).dropped or {}


def add_dropped(session: Session, more: Mapping[str, int]) -> None:
    """Add to the number of messages that the coordinators refused, by their kind."""
    changed(session, update(CoordinatorRow).values(dropped=dict(Counter(dropped(session)) + Counter(more))))


def store_id(session: Session) -> str | None:
    """Return the id of the artifact store of this farm; None if it is not known yet."""
    row = session.get(CoordinatorRow, 1, populate_existing=True)
    return None if row is None else row.store_id


def adopt_store(session: Session, identity: str, *, instead_of: str | None) -> None:
    """Store the id of the artifact store, unless another process has changed it in the meantime."""
    statement = update(CoordinatorRow).where(CoordinatorRow.store_id.is_not_distinct_from(instead_of))
    changed(session, statement.values(store_id=identity))


def request_stop(session: Session, attempts: Iterable[str | None], *, now_s: float) -> None:
    """Store that attempts must stop, by one statement."""
    rows = [{"attempt": attempt, "now_s": now_s} for attempt in dict.fromkeys(attempts) if attempt is not None]
    if rows:
        session.connection().execute(_REQUEST_STOP, rows)


def pending_stops(session: Session, limit: int = 500) -> Sequence[str]:
    """Return the attempts that must stop and have no stop signal in the broker yet, oldest first."""
    return session.scalars(_PENDING_STOPS, {"limit": limit}).all()


def delete_stops(session: Session, attempts: Sequence[str]) -> None:
    """Delete the stop requests of attempts whose stop signal is in the broker."""
    changed(session, delete(StopRequest).where(StopRequest.attempt.in_(attempts)))
