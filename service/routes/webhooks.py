"""The secret of webhooks, and what the contract says of their messages."""

from __future__ import annotations

from fastapi import APIRouter

from service.dependencies import AppStateDep, SubmitterDep
from service.errors import ServiceError
from service.schemas.webhook import WebhookMessage, WebhookSecret
from service.webhooks.signature import secret_of

router = APIRouter(tags=["access"])
messages = APIRouter()


@router.get("/webhook-secret")
def get_webhook_secret(state: AppStateDep, caller: SubmitterDep) -> WebhookSecret:
    """Get the secret with which a receiver verifies the webhooks of the caller's jobs.

    It changes when the key of the farm for links is replaced.
    """
    keys = state.links.keys()
    if not keys:
        raise ServiceError("the farm has no key for webhooks")
    return WebhookSecret(owner_id=caller.owner_id, secret=secret_of(keys[0], caller.owner_id))


@messages.post("job-ended", status_code=204)
def receive_message(message: WebhookMessage) -> None:
    """Receive the message about a job that has ended.

    Any status of 200 to 299 says that the receiver has it, and 410 ends the attempts. After every other answer or none,
    the farm tries again later. Redirects are not followed.
    """
