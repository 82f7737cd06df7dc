"""The scheduler dispatches ready tasks, best first, about two orders per slot.

The row becomes `dispatched` before the order is sent. A crash in between delays the task but never runs it twice.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from sqlalchemy.orm import Session

from lippmann.digest import Digest
from lippmann.job.messages.events import Presence
from lippmann.job.messages.orders import Order
from lippmann.job.states import JobStatus, TaskStatus
from service.coordinator.fair_share import Claim, share_out
from service.db import coordinator as coordinator_rows
from service.db import jobs as job_rows
from service.db import tasks as task_rows
from service.db.engine import Database
from service.db.tables import Job, Task
from service.errors import BrokerUnavailable
from service.events.publish import publish_task
from service.ids import new_attempt, parse_task_id, task_id
from service.jobs.state_machine import transition_job, transition_task
from service.jobs.verification import input_digests
from service.order_queue import OrderQueue
from service.settings import Settings

ROUND = 200
"""The largest number of orders in one transaction. Other writers wait for it, so the rest follows in the next round."""


def dispatch(
    database: Database, queue: OrderQueue, workers: Sequence[Presence], *, now_s: float, settings: Settings
) -> int:
    """Send as many orders as there is room for, and return their number.

    Raises
    ------
    BrokerUnavailable
        If the orders cannot be sent. Their tasks are ready again by then.
    """
    with database.reading() as session:
        if _room(session, workers, settings) <= 0 or not job_rows.can_dispatch(session, now_s=now_s):
            return 0
    with database.writing() as session:
        orders = assign(session, workers, now_s=now_s, settings=settings)
    try:
        if orders:
            queue.publish(orders)
    except BrokerUnavailable:
        with database.writing() as session:
            take_back(session, orders, now_s=now_s)
        raise
    return len(orders)


def assign(session: Session, workers: Sequence[Presence], *, now_s: float, settings: Settings) -> list[Order]:
    """Assign ready tasks to new attempts, and return their orders."""
    room = _room(session, workers, settings)
    idle_s = coordinator_rows.current(session).idle_s
    present = {worker.name for worker in workers}
    at_fault = {worker.name for worker in workers if worker.fault is not None}
    avoided: dict[str, set[str]] = {}
    orders = []
    best = _best(session, room, now_s)
    digests = input_digests(session, best)
    for task in best:
        row = session.get_one(Job, task.job_id, populate_existing=task.job_id not in avoided)
        if row.status is JobStatus.QUEUED:
            transition_job(session, row, JobStatus.PROBING, started_s=now_s)
        changed = transition_task(
            session, task, TaskStatus.DISPATCHED, attempt=new_attempt(), attempt_number=task.attempt_number + 1,
            worker=None, instance=None, progress=None, not_before_s=None, dispatched_s=now_s, dispatched_idle_s=idle_s,
            claimed_s=None, heartbeat_s=None, ended_s=None,
        )  # fmt: skip
        if changed:
            publish_task(session, task)
            if row.id not in avoided:
                avoided[row.id] = task_rows.avoided_workers(session, row.id, now_s=now_s)
            avoid = avoided[row.id] | set(task.failed_on) | at_fault
            inputs = digests.get((task.job_id, task.sequence), {})
            orders.append(_order(task, tuple(sorted(at_fault if present <= avoid else avoid)), inputs))
    return orders


def take_back(session: Session, orders: Sequence[Order], *, now_s: float) -> None:
    """Make tasks ready again whose orders failed; some may have been sent, so their attempts are requested to stop."""
    coordinator_rows.request_stop(session, [order.attempt for order in orders], now_s=now_s)
    for order in orders:
        task = task_rows.task(session, *parse_task_id(order.task_id))
        if task is not None and task.attempt == order.attempt and task.status is TaskStatus.DISPATCHED:
            transition_task(session, task, TaskStatus.READY)


def _room(session: Session, workers: Sequence[Presence], settings: Settings) -> int:
    slots = sum(worker.slots for worker in workers if worker.fault is None)
    return min(settings.orders_per_slot * slots - job_rows.outstanding(session), ROUND)


def _best(session: Session, room: int, now_s: float) -> list[Task]:
    claims = {claim[0]: Claim(*claim) for claim in job_rows.claims(session, now_s=now_s)}
    reached = dict.fromkeys(claims, -1)
    best: list[Task] = []
    while claims and len(best) < room:
        for job_id, wanted in share_out(claims.values(), room - len(best)).items():
            tasks = task_rows.ready(session, job_id, now_s=now_s, after=reached[job_id], limit=wanted)
            best += tasks
            claim = claims.pop(job_id)
            if len(tasks) == wanted < claim.ready:
                reached[job_id] = tasks[-1].sequence
                rest = replace(claim, outstanding=claim.outstanding + wanted, ready=claim.ready - wanted)
                claims[job_id] = rest
    return best


def _order(task: Task, avoid: tuple[str, ...], digests: dict[str, Digest]) -> Order:
    return Order(
        kind=task.kind,
        job_id=task.job_id,
        task_id=task_id(task.job_id, task.sequence),
        attempt=task.attempt or "",
        attempt_number=task.attempt_number,
        frame=task.frame,
        tile=task.tile,
        output=task.output,
        avoid=avoid,
        digests=digests,
    )
