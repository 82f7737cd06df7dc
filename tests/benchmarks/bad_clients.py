"""A healthy client while others do harm, against the same service without them.

The clients that do harm are other machines on a real farm, so here they have a low priority. The result says how many
requests they sent nevertheless, since a flood that is starved proves nothing.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import numpy as np

from lippmann.farm.adapters import make_parts
from lippmann.job.messages.events import Event
from lippmann.job.messages.orders import Order
from lippmann.job.spec import parse_spec
from tests.benchmarks.command import pss_mb
from tests.benchmarks.listening import (
    RunningService,
    listening_clients,
    measure,
    paced,
    running_job,
    running_service,
)
from tests.browser.studio import RIG, Studio
from tests.farm import ended
from tests.waiting import ENOUGH_S
from worker.store.opening import local_store

LOW_PRIORITY = ("nice", "-n", "15")
PICTURED = {"scene": "fish", "frames": "1-2", "rig": RIG, "render": {"tiles": [1, 1]}, "outputs": []}
"""The job of whose frames the expensive pictures are."""


def healthy_ratio(folder: Path) -> str:
    """Return p95 of the job list of a healthy client with bad clients against quiet, the memory, and the flood."""
    studio, first = Studio(make_parts(local_store(folder / "data")).store), list[str]()

    def answer(order: Order) -> list[Event]:
        first[:] = first or [order.job_id]
        return list(studio(order)) if order.job_id == first[0] else paced(order)

    with running_service(folder, answer) as service:
        pictured = ended(service.client, service.client.submit(parse_spec(PICTURED)).id, within_s=ENOUGH_S).id
        job_id = running_job(service.client)
        quiet = measure(service, job_id)
        with ExitStack() as stack:
            said = stack.enter_context(_hostile(service, pictured))
            path, received = f"/api/v1/jobs/{job_id}/events", folder / "received.npy"
            stack.enter_context(listening_clients(service, path, received, prefix=LOW_PRIORITY))
            bad = measure(service, job_id)
            memory_mb = pss_mb(service.pid)
    p95_ms = [1000 * float(np.percentile(phase.list_s, 95)) for phase in (bad, quiet)]
    return (
        f"{p95_ms[0] / p95_ms[1]:.1f} ({p95_ms[0]:.0f} / {p95_ms[1]:.0f} ms), {memory_mb:.0f} MB, "
        f"{bad.cores:.2f} cores of the service; {said[0]}"
    )


@contextmanager
def _hostile(service: RunningService, job_id: str) -> Iterator[list[str]]:
    """Run hostile clients while the context lasts; the list then has what they say of their flood."""
    said: list[str] = []
    key = service.client.create_key("viewer", "viewer").key
    command = [*LOW_PRIORITY, sys.executable, "-m", "tests.benchmarks.hostile_clients", service.url, key, job_id]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline()
        try:
            yield said
        finally:
            said.append(process.communicate(timeout=ENOUGH_S)[0].strip())
