"""Sets of tasks as plain values: read by a few queries, written by a few statements, the same on both databases."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import lru_cache
from typing import Any

from sqlalchemy import ColumnElement, Select, Update, bindparam, literal_column, or_, select, update
from sqlalchemy.orm import Session

from lippmann.job.states import HELD_TASKS, TaskStatus
from lippmann.plan.tasks import RENDERS_NOTHING
from service.db.tables import Task
from service.db.task_state import TaskKey, TaskState
from service.db.tasks import is_blocked

_STATE = tuple(getattr(Task, name) for name in TaskState._fields)
SPARSE = 4
"""One query covers several jobs if it examines at most so many pairs of job and value for each pair that is wanted."""
_IS_WAITING = Task.status == literal_column(f"'{TaskStatus.WAITING}'")
"""The condition that a task waits, as the index `ix_tasks_job_needs` has it."""
# Statements that every round executes are made once. Values in a list would cost as much as the execution.
_OF_JOBS = Task.job_id.in_(bindparam("job_ids", expanding=True))
_BY_KEYS = select(*_STATE).where(_OF_JOBS, Task.sequence.in_(bindparam("sequences", expanding=True)))
_UNBLOCK = (
    update(Task)
    .where(_OF_JOBS, Task.needs.in_(bindparam("needed", expanding=True)), _IS_WAITING, ~is_blocked())
    .values(status=TaskStatus.READY)
    .returning(Task.job_id)
)


class StaleRead(RuntimeError):
    """Status or attempt of a task is not what was read."""


Write = tuple[TaskState, Mapping[str, Any]]
"""A task as it was read, and the columns to write."""


def states(session: Session, keys: Iterable[TaskKey]) -> dict[TaskKey, TaskState]:
    """Return those tasks that exist, by key."""
    wanted = set(keys)
    found: dict[TaskKey, TaskState] = {}
    for job_ids, sequences in group_pairs(wanted):
        rows = session.execute(_BY_KEYS, {"job_ids": job_ids, "sequences": sequences})
        found |= {state.key: state for state in map(TaskState._make, rows) if state.key in wanted}
    return found


def ready(
    session: Session, job_id: str, *, now_s: float, after: int, limit: int, renders: bool | None = None
) -> list[TaskState]:
    """Return ready tasks of a job that are due, in order.

    Parameters
    ----------
    renders
        True for those that need the engine of the job, False for the others, None for all.
    """
    query = _select().where(Task.job_id == job_id, Task.status == TaskStatus.READY, Task.sequence > after)
    query = query.where(is_due(now_s))
    if renders is None:
        return _states(session, query.order_by(Task.sequence).limit(limit))
    if renders:
        return _states(session, query.where(Task.stage.not_in(RENDERS_NOTHING)).order_by(Task.sequence).limit(limit))
    # An index has the stages: these few tasks are sorted, or all that are ready would be read to get them in order.
    query = query.where(Task.stage.in_(RENDERS_NOTHING)).order_by(Task.sequence + literal_column("0"))
    return _states(session, query.limit(limit))


def held(session: Session, job_id: str, *, status: TaskStatus | None = None) -> list[TaskState]:
    """Return the tasks of a job that an attempt owns; there are few, because the queue is shallow."""
    statuses = HELD_TASKS if status is None else (status,)
    query = _select().where(Task.job_id == job_id, Task.status.in_(statuses))
    # To get this order from the database, SQLite would read all tasks of the job.
    return sorted(_states(session, query), key=lambda task: task.sequence)


def write(session: Session, writes: Iterable[Write]) -> None:
    """Write columns of tasks, by one statement for each set of columns.

    Raises
    ------
    StaleRead
        If status or attempt of a row is not what was read. The transaction must be rolled back.
    """
    groups: dict[tuple[str, ...], list[dict[str, Any]]] = defaultdict(list)
    for state, values in writes:
        guard = {"was_job": state.job_id, "was_sequence": state.sequence, "was_status": state.status}
        groups[tuple(sorted(values))].append({**values, **guard, "was_attempt": state.attempt})
    for names, rows in groups.items():
        count = session.connection().execute(_update(names), rows).rowcount
        if count != len(rows):
            raise StaleRead(f"expected to write {len(rows)} tasks, got {count}: the others are no longer as read")


def unblock(session: Session, stages: Iterable[tuple[str, str]]) -> Counter[str]:
    """Make the tasks ready that wait for one of some stages, (job, stage), if it is done; count them by job.

    The unfinished tasks of a stage are queried each time, since a counter of them could be wrong.
    """
    counts: Counter[str] = Counter()
    for job_ids, needed in group_pairs(set(stages)):
        counts.update(session.connection().scalars(_UNBLOCK, {"job_ids": job_ids, "needed": needed}).all())
    return counts


def is_due(now_s: float) -> ColumnElement[bool]:
    """Return the condition that a task may be dispatched now."""
    return or_(Task.not_before_s.is_(None), Task.not_before_s <= now_s)


def group_pairs(pairs: Iterable[tuple[str, Any]]) -> Iterator[tuple[list[str], list[Any]]]:
    """Divide pairs (job, value) into groups (jobs, values), such that few pairs of a group are not wanted.

    A condition on two lists uses an index on both databases; a condition on a list of pairs does not.

    >>> list(group_pairs([("a", 1), ("b", 2), ("c", 3)]))
    [(['a', 'b', 'c'], [1, 2, 3])]
    >>> pairs = [("a", 1), ("b", 2), ("c", 3), ("d", 4), ("e", 5)]
    >>> list(group_pairs(pairs))
    [(['a', 'b', 'c', 'd'], [1, 2, 3, 4]), (['e'], [5])]
    """
    by_job: dict[str, set[Any]] = defaultdict(set)
    for job_id, value in pairs:
        by_job[job_id].add(value)
    jobs: list[str] = []
    values: set[Any] = set()
    wanted = 0
    for job_id, more in sorted(by_job.items(), key=lambda item: (len(item[1]), sorted(item[1]), item[0])):
        if jobs and (len(jobs) + 1) * len(values | more) > SPARSE * (wanted + len(more)):
            yield jobs, sorted(values)
            jobs, values, wanted = [], set(), 0
        jobs, values, wanted = [*jobs, job_id], values | more, wanted + len(more)
    if jobs:
        yield jobs, sorted(values)


def _select() -> Select[Any]:
    return select(*_STATE)


def _states(session: Session, query: Select[Any]) -> list[TaskState]:
    return [TaskState._make(row) for row in session.execute(query)]


@lru_cache(maxsize=128)
def _update(names: Sequence[str]) -> Update:
    return (
        update(Task)
        .where(Task.job_id == bindparam("was_job"), Task.sequence == bindparam("was_sequence"))
        .where(Task.status == bindparam("was_status"))
        .where(Task.attempt.is_not_distinct_from(bindparam("was_attempt")))
        .values({name: bindparam(name) for name in names})
    )
