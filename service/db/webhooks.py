"""Queries on the webhook messages that are not delivered yet."""

from __future__ import annotations

from collections.abc import Sequence

from sqlalchemy import bindparam, delete, func, select, update
from sqlalchemy.orm import Session

from service.db.engine import changed
from service.db.tables import Job, WebhookDelivery

_OWNERS = (
    select(WebhookDelivery.owner_id)
    .where(WebhookDelivery.next_s <= bindparam("now_s"))
    .group_by(WebhookDelivery.owner_id)
    .order_by(func.min(WebhookDelivery.next_s))
    .limit(bindparam("limit"))
)


def owners_with_due(session: Session, *, now_s: float, limit: int) -> Sequence[str]:
    """Return the owners with a message that is due, the one that waits longest first."""
    return session.scalars(_OWNERS, {"now_s": now_s, "limit": limit}).all()


def first_due(session: Session, owner_id: str, *, now_s: float) -> WebhookDelivery | None:
    """Return the message of an owner that has been due for longest."""
    query = select(WebhookDelivery).where(WebhookDelivery.owner_id == owner_id, WebhookDelivery.next_s <= now_s)
    return session.scalars(query.order_by(WebhookDelivery.next_s, WebhookDelivery.id).limit(1)).first()


def begin_attempt(session: Session, delivery: WebhookDelivery, *, next_s: float) -> bool:
    """Count an attempt, and set when the next one is due; return False if another process began it."""
    same = (WebhookDelivery.id == delivery.id, WebhookDelivery.attempts == delivery.attempts)
    counted = update(WebhookDelivery).where(*same).values(attempts=delivery.attempts + 1, next_s=next_s)
    return changed(session, counted) == 1


def remove(session: Session, delivery_id: str) -> None:
    """Delete a message that is delivered or given up."""
    changed(session, delete(WebhookDelivery).where(WebhookDelivery.id == delivery_id))


def set_error(session: Session, job_id: str, error: str | None, *, url: str) -> bool:
    """Store why the webhook of a job failed, or that it did not; return whether this changed the job.

    A message that went to another URL, which is the one of the farm, changes nothing.
    """
    other = (Job.webhook_url == url, Job.webhook_error.is_distinct_from(error))
    return changed(session, update(Job).where(Job.id == job_id, *other).values(webhook_error=error)) == 1
