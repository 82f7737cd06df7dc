"""The message of a webhook, and the secret that verifies it."""

from __future__ import annotations

from datetime import datetime
from enum import StrEnum

from lippmann.job.states import JobStatus
from service.schemas.answer import Answer
from service.schemas.job import JobError


class WebhookType(StrEnum):
    """The event of a job that a message reports."""

    DONE = "job.done"
    FAILED = "job.failed"
    CANCELLED = "job.cancelled"


class EndedJob(Answer):
    """A job at the moment at which it ended."""

    id: str
    title: str
    scene: str
    status: JobStatus
    owner: str
    """The name of the key that submitted the job."""
    owner_id: str
    created_at: datetime
    started_at: datetime | None
    ended_at: datetime
    frames_total: int
    frames_done: int
    error: JobError | None
    """The reason why the job failed; null for a job that did not."""


class WebhookMessage(Answer):
    """The body of a webhook, which is sent to the URL that a job names when the job has ended.

    The header `Webhook-Id` is the same in every attempt to deliver the message. `Webhook-Timestamp` and
    `Webhook-Signature` are those of the Standard Webhooks.
    """

    type: WebhookType
    timestamp: datetime
    """When it happened."""
    data: EndedJob


class WebhookSecret(Answer):
    """The secret with which a receiver verifies the webhooks of the jobs of one owner."""

    owner_id: str
    secret: str
    """A key in the form of the Standard Webhooks: `whsec_` and the key in Base64."""
