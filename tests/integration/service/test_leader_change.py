"""Two processes of the service: the leader is stopped, cut off, killed and restarted in mid-job, and nothing is lost.

Requests and a stream of events go on all the time, at whichever process answers.
"""

from __future__ import annotations

import os
import signal
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest
from sqlalchemy import select

from lippmann.job.messages.events import Event
from lippmann.job.messages.orders import Order
from lippmann.job.states import TaskStatus
from service.db.engine import Database
from service.db.tables import JobEvent, Task
from service.schemas.events import EventTopic
from tests.broker import Broker
from tests.integration.service.conftest import FakeWorker, at_once
from tests.services import Balancer, EventReader, ServiceProcess, traffic
from tests.tcp_proxy import TcpProxy, tcp_proxy
from tests.waiting import until

TTL_S = 2.0
FRAMES = 12
JOB = {
    "scene": "target-white", "frames": f"1-{FRAMES}", "outputs": [],
    "rig": {"lens_array": {"count": [4, 4]}, "px_per_lens": 4}, "render": {"tiles": [1, 1], "cache": False},
}  # fmt: skip


@dataclass(frozen=True)
class Node:
    """A process of the service, and its way to the database."""

    process: ServiceProcess
    database: TcpProxy


@pytest.fixture
def nodes(tmp_path: Path, broker: Broker, postgresql_url: str) -> Iterator[list[Node]]:
    place = urlsplit(postgresql_url)
    with ExitStack() as stack:
        made = []
        for name in ("service0", "service1"):
            proxy = stack.enter_context(tcp_proxy(("127.0.0.1", place.port or 0)))
            assert isinstance(proxy.address, tuple)
            env = {
                **os.environ,
                "LIPPMANN_DATABASE_URL": postgresql_url.replace(f":{place.port}/", f":{proxy.address[1]}/"),
                "LIPPMANN_REDIS_URL": broker.url,
                "LIPPMANN_DATA_DIR": str(tmp_path),
                "LIPPMANN_LEADER_TTL_S": str(TTL_S),
                "LIPPMANN_KEEPALIVE_S": "0.5",
                "LIPPMANN_RECONCILE_S": "0.5",
            }
            made.append(Node(ServiceProcess(name, env, tmp_path), proxy))
            stack.callback(made[-1].process.end, signal.SIGKILL)
        for node in made:
            node.process.start()
        yield made


def slowly(order: Order) -> list[Event]:
    """Answer after a moment, so that the job lasts for as long as a fault."""
    time.sleep(0.05)
    return at_once(order)


def _stop(node: Node) -> None:
    node.process.halt()


def _go_on(node: Node) -> None:
    node.process.go_on()


def _cut(node: Node) -> None:
    node.database.refuse()


def _connect(node: Node) -> None:
    node.database.pass_on()


def _kill(node: Node) -> None:
    node.process.end(signal.SIGKILL)


def _restart(node: Node) -> None:
    node.process.end()


def _start(node: Node) -> None:
    node.process.start()


FAULTS: dict[str, tuple[Callable[[Node], None], Callable[[Node], None]]] = {
    "stopped": (_stop, _go_on),
    "cut from the database": (_cut, _connect),
    "killed": (_kill, _start),
    "restarted": (_restart, _start),
}


@pytest.mark.parametrize(
    "faults", [("stopped", "restarted"), pytest.param(("cut from the database", "killed"), marks=pytest.mark.long)]
)
def test_the_leader_is_stopped_cut_off_killed_or_restarted_in_mid_job_and_nothing_is_lost(
    tmp_path: Path, nodes: list[Node], make_worker: Callable[..., FakeWorker], postgresql_url: str,
    faults: Sequence[str],
) -> None:  # fmt: skip
    urls, key = [node.process.url for node in nodes], (tmp_path / "admin.key").read_text().strip()
    balancer, reader = Balancer(urls, key), EventReader(urls, key)
    worker = make_worker(slowly)

    def leader() -> Node | None:
        name = balancer.get("/health")["coordinator"]["leader"]
        pid = 0 if name is None else int(name.split("-")[-2])
        return next((node for node in nodes if node.process.pid == pid), None)

    def is_done(job_id: str) -> bool:
        return bool(balancer.get(f"/jobs/{job_id}")["status"] == "done")

    for fault in faults:
        begin, end = FAULTS[fault]
        job_id = balancer.request("POST", "/jobs", json=JOB, headers={"Idempotency-Key": fault}).json()["id"]
        until(lambda: balancer.get(f"/jobs/{job_id}")["frames_done"])  # noqa: B023 - called before the next round
        old = until(leader)
        (other,) = (node for node in nodes if node is not old)
        with traffic(balancer, [f"/jobs/{job_id}", "/jobs", f"/jobs/{job_id}/tasks"]) as sent:
            begun_s = time.monotonic()
            begin(old)
            until(lambda: _leader_seen_by(other, key) == other.process.pid)  # noqa: B023 - as above
            led_s = time.monotonic() - begun_s
            # The worker is replaced too: it ends what it has begun, and another one goes on.
            worker.stop()
            worker = make_worker(slowly, name=f"after {fault}")
            until(lambda: is_done(job_id))  # noqa: B023 - as above
            done_s = time.monotonic() - begun_s
            end(old)
            until(lambda: _leader_seen_by(old, key) == other.process.pid)  # noqa: B023 - as above
        print(
            f"{fault}: another process leads after {led_s:.1f} s, and the job is done after {done_s:.1f} s; "
            f"{sent.requests} requests, the longest took {sent.longest_s:.1f} s"
        )
        assert sent.requests > 0
        assert balancer.get(f"/jobs/{job_id}")["frames_done"] == FRAMES
    database = Database(postgresql_url)
    until(lambda: reader.ids == _stored_events(database))
    reader.stop()
    balancer.close()
    assert set(_times_done(database).values()) == {1}
    database.dispose()


def _leader_seen_by(node: Node, key: str) -> int | None:
    own = Balancer([node.process.url], key)
    name: Any = own.get("/health")["coordinator"]["leader"]
    own.close()
    return None if name is None else int(name.split("-")[-2])


def _stored_events(database: Database) -> list[int]:
    with database.reading() as session:
        return list(session.scalars(select(JobEvent.id).order_by(JobEvent.id)))


def _times_done(database: Database) -> Counter[str]:
    """Return how often each task was done, by the events, of all tasks that there are."""
    with database.reading() as session:
        data = session.scalars(select(JobEvent.data).where(JobEvent.topic == EventTopic.TASK)).all()
        tasks = session.scalars(select(Task.sequence)).all()
    done = Counter(f"{each['job']} {each['id']}" for each in data if each["status"] == TaskStatus.DONE)
    assert len(done) == len(tasks)
    return done
