"""The work of the last hours: the frames that were finished and the slots in use, in steps of equal length."""

from __future__ import annotations

from collections.abc import Iterable

from sqlalchemy.orm import Session

from lippmann.job.states import TaskStatus
from service.db import work as work_rows
from service.db.work import Span
from service.schemas.answer import utc
from service.schemas.work import FarmHistory

STEPS = 120
"""The number of steps."""


def farm_history(session: Session, *, hours: int, now_s: float) -> FarmHistory:
    """Return the work of the last hours."""
    step_s = 3600.0 * hours / STEPS
    begin_s = now_s - STEPS * step_s
    frames = work_rows.finished_frames(session, begin_s=begin_s, step_s=step_s)
    ended = work_rows.spans(session, begin_s=begin_s, step_s=step_s)
    running = [
        _running_span(task.claimed_s, begin_s=begin_s, step_s=step_s)
        for task in work_rows.held_tasks(
            session, [job.id for job in work_rows.busy_jobs(session, owner_id=None)], limit=100_000
        )
        if task.status is TaskStatus.RUNNING and task.claimed_s is not None and task.claimed_s <= now_s
    ]
    counted: dict[int, int] = {}
    for step, count in frames.items():
        last = min(step, STEPS - 1)
        counted[last] = counted.get(last, 0) + count
    return FarmHistory(
        begins_at=utc(begin_s),
        step_s=step_s,
        frames=tuple(counted.get(step, 0) for step in range(STEPS)),
        slots=slots_in_use([*ended, *running], steps=STEPS, step_s=step_s),
    )


def slots_in_use(spans: Iterable[Span], *, steps: int, step_s: float) -> tuple[float, ...]:
    """Return the mean number of slots in use in each step.

    Parameters
    ----------
    spans
        Tasks by the steps in which they began and ended; see `service.db.work.Span`.

    >>> slots_in_use([(0, 2, 1, 5.0, 25.0), (1, 1, 2, 24.0, 34.0)], steps=3, step_s=10.0)
    (0.5, 2.0, 0.5)
    """
    busy_s = [0.0] * steps
    for first, last, count, began_s, ended_s in spans:
        begin, end = min(max(first, 0), steps - 1), min(max(last, 0), steps - 1)
        if begin == end:
            busy_s[begin] += ended_s - began_s
            continue
        busy_s[begin] += count * (begin + 1) * step_s - began_s
        busy_s[end] += ended_s - count * end * step_s
        for step in range(begin + 1, end):
            busy_s[step] += count * step_s
    return tuple(round(seconds / step_s, 3) for seconds in busy_s)


def _running_span(claimed_s: float, *, begin_s: float, step_s: float) -> Span:
    began_s = max(claimed_s - begin_s, 0.0)
    return int(began_s / step_s), STEPS - 1, 1, began_s, STEPS * step_s
