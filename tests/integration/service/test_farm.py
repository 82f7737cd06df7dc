"""The whole service against a real broker, with a worker played by the test."""

from __future__ import annotations

from collections.abc import Callable

from lippmann.job.messages.orders import TaskKind
from tests.builders_service import SPEC
from tests.integration.service.conftest import FakeWorker, Service
from tests.waiting import until


def test_a_submitted_job_is_probed_planned_rendered_assembled_encoded_and_done(
    service: Service, make_worker: Callable[..., FakeWorker]
) -> None:
    worker = make_worker()
    answer = service.client.post("/jobs", json=SPEC)
    assert answer.status_code == 201
    job_id = answer.json()["id"]
    until(lambda: service.status(job_id) == "done")
    kinds = [order.kind for order in worker.orders]
    assert kinds[0] is TaskKind.PROBE
    assert kinds[-1] is TaskKind.ENCODE
    assert len(kinds) == 11
    job = service.client.get(f"/jobs/{job_id}").json()
    assert (job["progress"], job["frames_done"], job["tasks"]["done"]) == (1.0, 3, 11)
    assert job["outputs"] == [
        {
            "name": "views.mp4",
            "url": f"/api/v1/jobs/{job_id}/artifacts/video/views.mp4",
            "archive_url": f"/api/v1/jobs/{job_id}/outputs/views.mp4.zip",
            "ready": True,
        }
    ]
