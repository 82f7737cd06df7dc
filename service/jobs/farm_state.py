"""The state of the farm for the question why something waits, and which workers a job could have. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime
from functools import cached_property

from lippmann.job.messages.events import Closed, Presence
from lippmann.job.messages.orders import TaskKind, requirement_of
from lippmann.job.rendering.workers import JobRequirement, without_engine
from service.claiming import counted, rooms, takes_orders
from service.db.tables import Job
from service.jobs.fair_share import Claim, slots_by_owner
from service.roster import Roster
from service.schemas.answer import utc_or_none
from service.schemas.farm import Fault
from service.schemas.wait import WAITS, Wait, WaitCode
from service.settings import Settings

NAMED = 10
"""The largest number of jobs, of tasks and of workers that a reason names."""


@dataclass(frozen=True)
class FarmState:
    """The facts that decide which tasks are dispatched next."""

    now_s: float
    settings: Settings
    has_leader: bool
    faults: tuple[Fault, ...]
    """The causes that prevent all work of the farm, first cause first."""
    roster: Roster | None
    """The workers that are online, or those of them that a job may have; None if the broker does not answer."""
    line: tuple[Claim, ...] = ()
    """The first jobs with tasks that may be dispatched now, in the order in which they get slots."""
    holders: tuple[Claim, ...] = ()
    """All jobs with outstanding orders."""
    running: int = 0
    """The number of running tasks of all jobs, on workers whose slots count."""
    on_closed: Mapping[str, int] = field(default_factory=dict)
    """The number of the other running tasks, by the requirement of their jobs."""
    without_engine: Mapping[str, int] = field(default_factory=dict)
    """The number of outstanding orders that render nothing, by the requirement of jobs that have another."""
    asked: str = ""
    """The requirement that the workers of `roster` meet, if it has not all of them."""
    everybody: tuple[Presence, ...] | None = None
    """All workers that are online, where `roster` has only those that a job may have."""

    def of_job(self, row: Job, kind: TaskKind | None = None) -> FarmState:
        """Return the state with only those workers that a job may have, or its tasks of a kind."""
        asked = row.requirement if kind is None else requirement_of(row.requirement, kind)
        if self.roster is None:
            return replace(self, asked=asked)
        return replace(self, asked=asked, roster=self.roster.fitting(asked), everybody=self.roster.present)

    @property
    def able(self) -> tuple[Presence, ...]:
        """The workers whose slots count."""
        return () if self.roster is None else self.roster.able

    @property
    def slots(self) -> int:
        """The slots that count."""
        return sum(worker.slots for worker in self.able)

    @cached_property
    def held(self) -> Mapping[str, int]:
        """The slots that the jobs of each owner hold."""
        return slots_by_owner(self.holders)

    @property
    def has_free_slot(self) -> bool:
        """True if a slot is free for an order."""
        is_part = self.everybody is not None and len(self.everybody) > len(self.roster.present if self.roster else ())
        if is_part and all(worker.holds is not None for worker in self.able):
            return any(len(worker.holds or ()) < worker.slots for worker in self.able)
        return self.running < self.slots

    def room(self) -> int:
        """Return the number of orders for which the next round of the scheduler has room, of all jobs together."""
        slots = sum(worker.slots for worker in self._all_able)
        return max(self.settings.orders_per_slot * slots - sum(self._in_slots().values()), 0)

    def rooms(self, requirements: Iterable[str] = ()) -> Mapping[str, int]:
        """Return that number by the requirement of the jobs: those in line, and some others."""
        of_claims = {claim.requirement for claim in (*self.line, *self.holders)}
        asked = {"", *requirements, *of_claims, *map(without_engine, of_claims)}
        return rooms(self._all_able, self._in_slots(), asked, per_slot=self.settings.orders_per_slot)

    def _in_slots(self) -> Mapping[str, int]:
        """Return the number of outstanding orders in slots that count, by the requirement of their jobs."""
        held: dict[str, int] = {}
        for claim in self.holders:
            held[claim.requirement] = held.get(claim.requirement, 0) + claim.outstanding
        for requirement, count in self.without_engine.items():
            other = without_engine(requirement)
            held[requirement] = held.get(requirement, 0) - count
            held[other] = held.get(other, 0) + count
        return counted(self._all_able, held, self.on_closed)

    @property
    def _all_able(self) -> tuple[Presence, ...]:
        """The workers whose slots count, those included that the job may not have."""
        if self.roster is None or self.everybody is None:
            return self.able
        return Roster(self.everybody, self.roster.not_claiming).able


def wait_of(code: WaitCode, message: str | None = None, **more: object) -> Wait:
    """Return a reason, with the sentence of its code if no other is given."""
    return Wait.model_validate({"code": code, "message": message or WAITS[code], **more})


def wait_for_workers(farm: FarmState) -> Wait | None:
    """Return why no worker does the work of a job; None if some could.

    Parameters
    ----------
    farm
        The state with the workers that the job may have.
    """
    if farm.roster is None:
        return wait_of(WaitCode.BROKER_AWAY)
    everybody = farm.everybody if farm.everybody is not None else farm.roster.present
    if not everybody:
        return wait_of(WaitCode.NO_WORKER)
    if not farm.roster.present:
        return wait_of(WaitCode.NO_FITTING_WORKER, f"No worker that is online {_lacking(farm.asked, everybody)}.")
    return None if farm.able else _unable(farm.roster)


def _lacking(requirement: str, workers: Sequence[Presence]) -> str:
    """Return what no worker has, or what the one lacks that has the most, as the end of a sentence."""
    needed = JobRequirement.of(requirement)
    lacks = {worker.name: worker.lacks(needed) for worker in workers}
    by_all = [part for part in dict.fromkeys(sum(lacks.values(), ())) if all(part in parts for parts in lacks.values())]
    if by_all:
        return _has(by_all)
    name = min(lacks, key=lambda each: (len(lacks[each]), each))
    return f"has everything that the job asks for; {name} lacks {' and '.join(lacks[name])}"


def _has(parts: Sequence[str]) -> str:
    return f"has {' and '.join(parts)}, which the job asks for" if parts != ["no pool"] else "is outside all pools"


def _unable(roster: Roster) -> Wait:
    names = tuple(worker.name for worker in roster.present)[:NAMED]
    at_fault = next((worker for worker in roster.claiming if worker.fault is not None), None)
    if at_fault is not None and at_fault.fault is not None:
        message = f"No worker can work; {at_fault.name}: {at_fault.fault.message}."
        return wait_of(WaitCode.FARM_FAULT, message, fault=at_fault.fault.code, workers=names)
    closed = [worker for worker in roster.present if not takes_orders(worker)]
    if not closed:
        return wait_of(WaitCode.NOT_CLAIMING, workers=names)
    opens_s = min((worker.opens_s for worker in closed if worker.opens_s is not None), default=None)
    reasons = "; ".join(f"{worker.name} {closed_text(worker)}" for worker in closed[:NAMED])
    message = f"No worker that may do it takes orders: {reasons}."
    return wait_of(WaitCode.WORKERS_CLOSED, message, until_at=utc_or_none(opens_s), workers=names)


def closed_text(worker: Presence) -> str:
    """Return why a worker takes no orders by its own decision, as the end of a sentence."""
    if worker.closed == Closed.HOURS:
        opens = (
            ""
            if worker.opens_s is None
            else f" until {datetime.fromtimestamp(worker.opens_s).astimezone():%a %H:%M %Z}"
        )
        return f"is outside its hours{opens}"
    if worker.closed == Closed.DRAINING:
        return "is drained"
    return f"runs Lippmann {worker.version}, whose messages this service does not understand"
