"""The scheduler dispatches ready tasks, best first, about two orders per slot, and more of them if tasks are short.

The row becomes `dispatched` before the order is sent. A crash in between delays the task but never runs it twice.
"""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType

from sqlalchemy.orm import Session

from lippmann.digest import Digest
from lippmann.job.messages.events import Presence
from lippmann.job.messages.orders import Order, TaskKind, requirement_of
from lippmann.job.rendering.workers import without_engine
from lippmann.job.states import TaskStatus
from lippmann.plan.cost import threads_of_each
from service.claiming import counted, declining_workers, fitting, is_able, not_able, rooms
from service.db import coordinator as coordinator_rows
from service.db import jobs as job_rows
from service.db import task_sets
from service.db import tasks as task_rows
from service.db.engine import Database
from service.db.faults import avoided_workers
from service.db.task_state import TaskState
from service.errors import BrokerUnavailable
from service.ids import new_attempt, parse_task_id, task_id
from service.jobs.fair_share import Claim, share_out
from service.jobs.limits import claim_of
from service.jobs.state_machine import begin_jobs, write_drafts
from service.jobs.task_draft import TaskDraft
from service.jobs.verification import input_digests
from service.order_queue import OrderQueue
from service.settings import Settings

ROUND = 200
"""The largest number of orders in one transaction. Other writers wait for it, so the rest follows in the next round."""
AHEAD_S = 0.5
"""The time for which the outstanding orders last at least, by the number of orders of the last second. Tasks of some
milliseconds would end faster than two orders per slot are replaced."""
RATE_S = 1.0


class OrderRate:
    """The number of orders of the last second, from which follows how many are sent ahead."""

    def __init__(self) -> None:
        self._sent: deque[tuple[float, int]] = deque()

    def record(self, sent: int, *, at_s: float) -> None:
        """Record that some orders were sent at a time of a clock that is never set."""
        self._sent.append((at_s, sent))

    def ahead(self, *, at_s: float) -> int:
        """Return the number of orders that last for `AHEAD_S`."""
        while self._sent and at_s - self._sent[0][0] > RATE_S:
            self._sent.popleft()
        return int(sum(sent for _, sent in self._sent) / RATE_S * AHEAD_S)


def dispatch(
    database: Database,
    queue: OrderQueue,
    workers: Sequence[Presence],
    *,
    now_s: float,
    settings: Settings,
    ahead: int = 0,
) -> int:
    """Send as many orders as there is room for, and return their number.

    Parameters
    ----------
    ahead
        The number of outstanding orders for which there is room even if it is more than two per slot.

    Raises
    ------
    BrokerUnavailable
        If the orders cannot be sent. Their tasks are ready again by then.
    """
    with database.reading() as session:
        held = Outstanding(job_rows.outstanding(session))
        requirements = ("", *job_rows.requirements(session))
        on_closed = job_rows.running_on(session, not_able(workers))
        in_slots = counted(workers, held.by_requirement, on_closed)
        by_requirement = rooms(workers, in_slots, requirements, per_slot=settings.orders_per_slot, ahead=ahead)
        room = _room(sum(in_slots.values()), workers, settings, ahead)
        if room <= 0 or not _has_work(session, by_requirement, now_s):
            return 0
    with database.writing() as session:
        # Only the leader sends orders, so that until here an owner can only have come to hold fewer.
        claims = {row[0]: claim_of(row, settings) for row in job_rows.claims(session, now_s=now_s)}
        best = _best(session, claims.values(), held, room, by_requirement, now_s)
        asked = {claim.job_id: claim.requirement for claim in claims.values()}
        threads = _threads(claims, held, workers, best)
        orders = assign(session, workers, best, now_s=now_s, threads=threads, requirements=asked)
    try:
        if orders:
            queue.publish(orders)
    except BrokerUnavailable:
        with database.writing() as session:
            take_back(session, orders, now_s=now_s)
        raise
    return len(orders)


def assign(
    session: Session,
    workers: Sequence[Presence],
    ready: Sequence[TaskState],
    *,
    now_s: float,
    threads: int = 1,
    requirements: Mapping[str, str] = MappingProxyType({}),
) -> list[Order]:
    """Assign ready tasks to new attempts, by a handful of statements, and return their orders.

    Parameters
    ----------
    threads
        The number of threads that each task may use.
    requirements
        What the jobs of these tasks ask of their workers, by job.
    """
    if not ready:
        return []
    coordinator = coordinator_rows.current(session)
    drafts = [TaskDraft(task) for task in ready]
    job_ids = {draft.now.job_id for draft in drafts}
    begin_jobs(session, job_ids, now_s=now_s)
    for draft in drafts:
        draft.transition(
            TaskStatus.DISPATCHED, attempt=new_attempt(), attempt_number=draft.now.attempt_number + 1,
            worker=None, instance=None, progress=None, not_before_s=None, dispatched_s=now_s,
            dispatched_idle_s=coordinator.idle_s, claimed_s=None, heartbeat_s=None, ended_s=None,
        )  # fmt: skip
    write_drafts(session, drafts, now_s=now_s)
    tasks = [draft.now for draft in drafts]
    avoided, digests = avoided_workers(session, job_ids, now_s=now_s), input_digests(session, tasks)
    skipped = task_rows.skipped_frames(session, {task.job_id for task in tasks if task.kind is TaskKind.ENCODE})
    asked = {task.key: requirement_of(requirements.get(task.job_id, ""), task.kind) for task in tasks}
    able = {requirement: fitting(workers, requirement) for requirement in set(asked.values())}
    return [
        _order(
            task,
            asked[task.key],
            declining_workers(able[asked[task.key]], avoided[task.job_id] | set(task.failed_on)),
            digests.get(task.key, {}),
            skipped.get(task.job_id, ()) if task.kind is TaskKind.ENCODE else (),
            coordinator.store_id,
            threads,
        )
        for task in tasks
    ]


def take_back(session: Session, orders: Sequence[Order], *, now_s: float) -> None:
    """Make tasks ready again whose orders failed; some may have been sent, so their attempts are requested to stop."""
    coordinator_rows.request_stop(session, [order.attempt for order in orders], now_s=now_s)
    attempts = {parse_task_id(order.task_id): order.attempt for order in orders}
    drafts = [TaskDraft(task) for task in task_sets.states(session, attempts).values()]
    mine = [draft for draft in drafts if draft.now.attempt == attempts[draft.now.key]]
    taken = [draft for draft in mine if draft.now.status is TaskStatus.DISPATCHED]
    for draft in taken:
        draft.transition(TaskStatus.READY)
    write_drafts(session, taken, now_s=now_s)


class Outstanding:
    """The number of outstanding orders.

    Parameters
    ----------
    held
        The number by the owner of the jobs and the requirement of the tasks.
    """

    def __init__(self, held: Mapping[tuple[str, str], int]) -> None:
        self.by_owner: Counter[str] = Counter()
        self.by_requirement: Counter[str] = Counter()
        for (owner_id, requirement), count in held.items():
            self.by_owner[owner_id] += count
            self.by_requirement[requirement] += count
        self.total = self.by_owner.total()


def _room(in_slots: int, workers: Sequence[Presence], settings: Settings, ahead: int) -> int:
    slots = sum(worker.slots for worker in workers if is_able(worker))
    if not slots:
        return 0
    return min(max(settings.orders_per_slot * slots, ahead) - in_slots, ROUND)


def _threads(
    claims: Mapping[str, Claim], held: Outstanding, workers: Sequence[Presence], best: Sequence[TaskState]
) -> int:
    """Return the number of threads of each task: more than one if the only worker would have idle slots with these."""
    able = [worker for worker in workers if is_able(worker)]
    if not best or len(able) != 1 or held.total:
        return 1
    # A job or its owner may be allowed fewer slots than there are.
    limits = (limit for task in best for limit in (claims[task.job_id].max_slots, claims[task.job_id].own_slots))
    return threads_of_each(len(best), slots=min(able[0].slots, *(limit for limit in limits if limit is not None)))


def _has_work(session: Session, rooms: Mapping[str, int], now_s: float) -> bool:
    """Return whether some task may be dispatched now for which there is room, by the requirements of tasks."""
    if job_rows.can_dispatch(session, [asked for asked, room in rooms.items() if room > 0], now_s=now_s):
        return True
    # Where an engine has no room, tasks of its jobs that render nothing may have.
    others = {asked: without_engine(asked) for asked, room in rooms.items() if room <= 0}
    mixed = [asked for asked, other in others.items() if other != asked and rooms.get(other, 0) > 0]
    if not mixed or not job_rows.can_dispatch(session, mixed, now_s=now_s):
        return False
    jobs = [row[0] for row in job_rows.claims(session, now_s=now_s) if row[6] in mixed]
    return any(task_sets.ready(session, job_id, now_s=now_s, after=-1, limit=1, renders=False) for job_id in jobs)


def _best(
    session: Session,
    of_jobs: Iterable[Claim],
    held: Outstanding,
    room: int,
    by_requirement: Mapping[str, int],
    now_s: float,
) -> list[TaskState]:
    parts = {of_job.job_id: of_job.by_requirement() for of_job in of_jobs}
    siblings = {job_id: {claim.key for claim in of_job} for job_id, of_job in parts.items()}
    claims = {claim.key: claim for of_job in parts.values() for claim in of_job}
    reached = dict.fromkeys(claims, -1)
    holds = Counter(held.by_owner)
    left = Counter(by_requirement)
    best: list[TaskState] = []
    while len(best) < room and (shares := share_out(claims.values(), room - len(best), held=holds, rooms=left)):
        for key, wanted in shares.items():
            claim = claims.pop(key)
            tasks = task_sets.ready(
                session, claim.job_id, now_s=now_s, after=reached[key], limit=wanted, renders=claim.renders
            )
            best += tasks
            holds[claim.owner_id] += len(tasks)
            left[claim.requirement] -= len(tasks)
            if len(tasks) == wanted < claim.ready:
                reached[key] = tasks[-1].sequence
                claims[key] = replace(claim, ready=claim.ready - wanted)
            for other in siblings[claim.job_id] & claims.keys():
                claims[other] = replace(claims[other], outstanding=claims[other].outstanding + len(tasks))
    return best


def _order(
    task: TaskState, requirement: str, avoid: tuple[str, ...], digests: dict[str, Digest],
    skipped_frames: tuple[int, ...], store_id: str | None, threads: int,
) -> Order:  # fmt: skip
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
        skipped_frames=skipped_frames,
        digests=digests,
        threads=threads,
        requirement=requirement,
        store_id=store_id,
    )
