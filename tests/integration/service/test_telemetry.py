"""Spans reach a collector, and those of a job are one trace from its plan to its attempts."""

from __future__ import annotations

import http.server
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from opentelemetry.proto.collector.trace.v1.trace_service_pb2 import ExportTraceServiceRequest

from lippmann.errors import RenderFailed
from lippmann.job.messages.orders import Order
from lippmann.telemetry import context_of_job, start_telemetry, stop_telemetry
from tests.broker import Broker
from tests.builders_messages import seals_in
from tests.builders_service import SPEC
from tests.waiting import until
from worker.sandbox.sandbox import Sandbox
from worker.settings import WorkerSettings
from worker.tasks.attempts.attempt import TaskResult, attempt
from worker.tasks.attempts.monitor import ProgressMonitor
from worker.tasks.attempts.workplace import Workplace

_OFF = """
import sys
import service.main, worker.tasks.attempts.attempt
from lippmann.telemetry import span, start_telemetry
start_telemetry("", process="p", instance="i")
with span("s", job="j") as made:
    assert made.context is None
    made.fail("code")
# The client of Redis imports parts of the SDK by itself where it is installed.
assert not [name for name in sys.modules if name.startswith("opentelemetry.exporter")]
"""


@dataclass(frozen=True)
class Received:
    """A span as the collector gets it."""

    process: str
    name: str
    trace: str
    id: str
    parent: str
    is_error: bool
    attributes: dict[str, Any]


class Collector:
    """A small receiver of OTLP over HTTP."""

    def __init__(self) -> None:
        self.spans: list[Received] = []
        spans = self.spans

        class Handler(http.server.BaseHTTPRequestHandler):
            def do_POST(self) -> None:
                assert self.path == "/v1/traces"
                sent = ExportTraceServiceRequest.FromString(self.rfile.read(int(self.headers["Content-Length"])))
                spans.extend(_received(sent))
                self.send_response(200)
                self.end_headers()

            def log_message(self, *_: object) -> None:
                pass

        self._server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.url = f"http://127.0.0.1:{self._server.server_port}"
        self._thread = threading.Thread(target=self._server.serve_forever, daemon=True)
        self._thread.start()

    def named(self, name: str) -> list[Received]:
        return [span for span in self.spans if span.name == name]

    def close(self) -> None:
        self._server.shutdown()
        self._server.server_close()
        self._thread.join()


def _received(sent: ExportTraceServiceRequest) -> Iterator[Received]:
    for resource in sent.resource_spans:
        about = {each.key: each.value.string_value for each in resource.resource.attributes}
        for scope in resource.scope_spans:
            for span in scope.spans:
                attributes = {
                    each.key.removeprefix("lippmann."): each.value.string_value or each.value.int_value
                    for each in span.attributes
                }
                yield Received(
                    about["service.name"], span.name, span.trace_id.hex(), span.span_id.hex(),
                    span.parent_span_id.hex(), span.status.code == 2, attributes,
                )  # fmt: skip


@pytest.fixture
def collector() -> Iterator[Collector]:
    collector = Collector()
    yield collector
    stop_telemetry()
    collector.close()


def test_without_a_collector_nothing_is_sent_and_nothing_imported() -> None:
    subprocess.run([sys.executable, "-W", "ignore", "-c", _OFF], check=True)


def test_a_job_is_one_trace_from_its_plan_to_its_attempts(
    collector: Collector, broker: Broker, make_service: Callable[..., Any], make_worker: Callable[..., Any],
    tmp_path: Path,
) -> None:  # fmt: skip
    service, worker = make_service(telemetry_url=collector.url), make_worker()
    job_id = service.client.post("/jobs", json=SPEC, headers={"X-Request-ID": "mine"}).json()["id"]
    until(lambda: service.status(job_id) == "done")
    service.stop()
    _, trace, root, _ = context_of_job(job_id).split("-")
    assert {(span.trace, span.parent) for span in collector.named("plan")} == {(trace, root)}
    orders = {span.attributes["attempt"]: span for span in collector.named("order")}
    assert {order.attempt: order.trace for order in worker.orders} == {
        name: f"00-{trace}-{span.id}-01" for name, span in orders.items()
    }
    (submitted,) = collector.named("POST /api/v1/jobs")
    assert (submitted.process, submitted.attributes["request_id"]) == ("lippmann-service", "mine")
    assert (submitted.attributes["status"], submitted.is_error) == (201, False)
    assert collector.named("GET /api/v1/jobs/{job_id}")[0].attributes["job"] == job_id

    start_telemetry(collector.url, process="lippmann-worker", instance="w1")
    first: Order = worker.orders[0]
    settings = WorkerSettings(redis_url=broker.url, data_dir=tmp_path, worker_name="w1")
    settings.scratch_dir.mkdir(parents=True, exist_ok=True)
    seals_in(tmp_path)

    def fail(_place: Workplace, _order: Order, _monitor: ProgressMonitor) -> TaskResult:
        raise RenderFailed

    attempt(Workplace(settings=settings, sandbox=Sandbox("none")), first, fail)
    stop_telemetry()
    (made,) = collector.named("attempt probe")
    assert (made.trace, made.parent, made.is_error) == (trace, orders[first.attempt].id, True)
    assert (made.attributes["worker"], made.attributes["outcome"]) == ("w1", "render-failed")
