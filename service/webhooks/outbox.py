"""The outbox of webhooks: a message is stored in the transaction that ends its job, and deleted when delivered."""

from __future__ import annotations

import secrets

from sqlalchemy.orm import Session

from lippmann.job.states import ENDED_JOBS
from service.db.tables import ADMIN_OWNER, Job, WebhookDelivery
from service.schemas.answer import utc, utc_or_none
from service.schemas.job import JobError
from service.schemas.webhook import EndedJob, WebhookMessage, WebhookType


def store_message(session: Session, row: Job) -> None:
    """Store a message for the webhook of a job, and one for that of the farm, if the job has them and has ended.

    The secret of the farm's own is the one of its admin.
    """
    receivers = ((row.webhook_url, row.owner_id), (row.farm_webhook_url, ADMIN_OWNER))
    for url, owner_id in receivers:
        if url is None or row.status not in ENDED_JOBS or row.ended_s is None:
            continue
        session.add(
            WebhookDelivery(
                id=f"msg_{secrets.token_hex(12)}",
                job_id=row.id,
                owner_id=owner_id,
                url=url,
                body=_message(row, row.ended_s).model_dump_json(),
                created_s=row.ended_s,
                attempts=0,
                next_s=row.ended_s,
            )
        )
        session.flush()


def _message(row: Job, ended_s: float) -> WebhookMessage:
    failed = row.error_code is not None
    return WebhookMessage(
        type=WebhookType(f"job.{row.status.value}"),
        timestamp=utc(ended_s),
        data=EndedJob(
            id=row.id,
            title=row.title,
            scene=row.scene,
            status=row.status,
            owner=row.owner,
            owner_id=row.owner_id,
            created_at=utc(row.created_s),
            started_at=utc_or_none(row.started_s),
            ended_at=utc(ended_s),
            frames_total=row.frames_total,
            frames_done=row.frames_done,
            error=JobError(code=row.error_code or "", message=row.error_message or "") if failed else None,
        ),
    )
