"""A job that names a webhook, from a request to the message that a running service sends."""

from __future__ import annotations

import json
from collections.abc import Callable

from tests.builders_service import SPEC
from tests.integration.service.conftest import FakeWorker, Service
from tests.receiver import receiving
from tests.waiting import until


def test_a_running_service_sends_the_webhook_of_a_job_that_is_done(
    make_service: Callable[..., Service], make_worker: Callable[..., FakeWorker]
) -> None:
    service = make_service(webhook_hosts="127.0.0.1", webhook_http=True)
    make_worker()
    with receiving() as receiver:
        made = service.client.post("/jobs", params={"webhook": receiver.url}, json=SPEC).json()
        message = json.loads(receiver.next().body)
        assert (message["type"], message["data"]["id"]) == ("job.done", made["id"])
        until(lambda: service.client.get(f"/jobs/{made['id']}").json()["webhook"]["error"] is None)
        service.stop()
        assert receiver.received.empty()
