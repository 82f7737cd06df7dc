"""One attempt against a real Valkey: what is said, and when nothing is."""

from __future__ import annotations

import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import structlog
from redis import Redis

from lippmann.errors import RenderFailed, SceneError, Stopped
from lippmann.job.messages import wire
from lippmann.job.messages.events import Event, EventKind, Lease, ProbeResult
from lippmann.job.messages.orders import Order, TaskKind
from tests.broker import Broker
from tests.builders_messages import SEALS, seals_in
from tests.waiting import ENOUGH_S, until
from worker.refusals import refusals
from worker.report import AttemptHeartbeat, BrokerClient
from worker.sandbox.child import lost_cpu
from worker.sandbox.sandbox import Sandbox
from worker.settings import WorkerSettings
from worker.tasks.attempts.attempt import TaskResult, attempt
from worker.tasks.attempts.monitor import ProgressMonitor
from worker.tasks.attempts.workplace import Workplace

_HANGS = """
import sys, threading
from lippmann.job.messages.orders import Order
from tests.builders_messages import SEALS
from worker.report import AttemptHeartbeat, BrokerClient
order = Order(kind="encode", job_id="j", task_id="t", attempt="a", attempt_number=1)
with AttemptHeartbeat(BrokerClient(sys.argv[1], "w1", seals=SEALS), order, worker_stopping=lambda: False, hung_s=2.0):
    threading.Event().wait(60)
"""


@pytest.fixture(scope="module")
def redis_url(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    broker = Broker(tmp_path_factory.mktemp("broker"))
    yield broker.url
    broker.kill()


@pytest.fixture
def redis(redis_url: str) -> Redis:
    connection: Redis = Redis.from_url(redis_url)
    connection.flushall()
    return connection


@pytest.fixture
def place(redis_url: str, tmp_path: Path) -> Workplace:
    seals_in(tmp_path)
    settings = WorkerSettings(redis_url=redis_url, data_dir=tmp_path, worker_name="w1")
    settings.scratch_dir.mkdir(parents=True)
    return Workplace(settings=settings, sandbox=Sandbox("none"))


def order(**more: object) -> Order:
    data = {"kind": TaskKind.PROBE, "job_id": "j", "task_id": "t", "attempt": "a1", "attempt_number": 1}
    return Order.model_validate(data | more)


def said(redis: Redis) -> list[Event]:
    entries: Any = redis.xrange(wire.EVENTS_STREAM)
    return [Event.model_validate_json(fields[b"event"]) for _, fields in entries]


def doing(result: TaskResult | Exception) -> Callable[[Workplace, Order, ProgressMonitor], TaskResult]:
    def do(place: Workplace, order: Order, monitor: ProgressMonitor) -> TaskResult:
        if isinstance(result, Exception):
            raise result
        return result

    return do


def test_an_attempt_that_ends_well_says_claimed_and_done(place: Workplace, redis: Redis) -> None:
    measured = ProbeResult(start_s=0.7, s_per_px=1e-5, tileable=True)
    attempt(place, order(), doing(TaskResult(probe=measured)))
    claimed, done = said(redis)
    assert (claimed.kind, done.kind) == (EventKind.CLAIMED, EventKind.DONE)
    assert done.attempt == "a1"
    assert done.probe == measured
    assert not redis.exists(wire.lease_key("a1"))


@pytest.mark.parametrize("fails", [False, True])
def test_the_seconds_of_every_program_count_also_if_the_attempt_fails(
    place: Workplace, redis: Redis, *, fails: bool
) -> None:
    """A program such as the report of a scene's camera, whose outcome is not that of the task."""
    program = [sys.executable, "-c", "import time\nwhile time.process_time() < 0.3: pass"]

    def do(place: Workplace, order: Order, monitor: ProgressMonitor) -> TaskResult:
        subprocess.run(program, check=True)
        lost_cpu.add(counted_s=0.5, of_group_s=1.5)
        if fails:
            raise SceneError("line 3: what")
        return TaskResult()

    attempt(place, order(), do)
    ended = said(redis)[-1]
    assert ended.kind is (EventKind.FAILED if fails else EventKind.DONE)
    assert ended.cpu_s is not None
    assert ended.cpu_s >= 1.3


@pytest.mark.parametrize(
    ("error", "code", "permanent"),
    [
        (SceneError("line 3: what"), "scene", True),
        (RenderFailed(), "render-failed", False),
        (Stopped(), "stopped", False),
        (OSError(28, "No space left on device"), "disk-full", False),
        (OSError(30, "Read-only file system"), "disk-unavailable", False),
        (ZeroDivisionError("oh"), "unexpected", False),
    ],
)
def test_a_failure_says_what_it_was_and_whether_to_try_again(
    place: Workplace, redis: Redis, error: Exception, code: str, permanent: bool
) -> None:
    attempt(place, order(), doing(error))
    failed = said(redis)[-1]
    assert failed.kind is EventKind.FAILED
    assert failed.failure is not None
    assert (failed.failure.code, failed.failure.permanent) == (code, permanent)
    assert failed.failure.message


def test_every_line_that_is_logged_in_an_attempt_has_its_ids(place: Workplace, redis: Redis) -> None:
    def do(place: Workplace, order: Order, monitor: ProgressMonitor) -> TaskResult:
        structlog.get_logger("worker.images").info("somewhere inside")
        raise SceneError("line 3: what")

    with structlog.testing.capture_logs(processors=[structlog.contextvars.merge_contextvars]) as logged:
        attempt(place, order(job_id="j7", task_id="j7.3", attempt="a9"), do)
        structlog.get_logger().info("afterwards")
    assert [line["event"] for line in logged] == ["somewhere inside", "attempt failed", "afterwards"]
    assert [(line.get("job"), line.get("task"), line.get("attempt")) for line in logged] == [
        ("j7", "j7.3", "a9"), ("j7", "j7.3", "a9"), (None, None, None),
    ]  # fmt: skip


def test_an_attempt_publishes_nothing_in_another_store_than_its_order_names(place: Workplace, redis: Redis) -> None:
    def put(place: Workplace, order: Order, _monitor: ProgressMonitor) -> TaskResult:
        place.store.put_bytes("j/a", b"a")
        return TaskResult()

    attempt(place, order(store_id="0123"), put)
    failed = said(redis)[-1]
    assert (failed.kind, failed.failure and failed.failure.code) == (EventKind.FAILED, "store-unavailable")
    place.store.expect(None)
    assert place.store.list("") == []
    identity = place.store.make_identity()
    for attempt_id, store_id in (("a2", identity), ("a3", None)):
        attempt(place, order(attempt=attempt_id, store_id=store_id), put)
        assert said(redis)[-1].kind is EventKind.DONE


def test_an_attempt_of_a_process_that_cannot_open_the_store_fails_and_the_next_one_opens_it(
    place: Workplace, redis: Redis
) -> None:
    """A process that has done nothing yet meets a mount that is away: the order has left the queue, and must end."""
    in_the_way = place.settings.artifacts_dir
    in_the_way.write_text("")
    attempt(place, order(), doing(TaskResult()))
    claimed, failed = said(redis)
    assert claimed.kind is EventKind.CLAIMED
    assert (failed.kind, failed.failure and failed.failure.code) == (EventKind.FAILED, "store-unavailable")
    in_the_way.unlink()
    attempt(place, order(attempt="a2"), doing(TaskResult()))
    assert said(redis)[-1].kind is EventKind.DONE


def test_an_order_of_a_newer_service_is_understood() -> None:
    assert Order.model_validate(order().model_dump() | {"colour": "red"}) == order()


def test_a_process_whose_work_hangs_ends_itself(redis_url: str, tmp_path: Path) -> None:
    ran = subprocess.run([sys.executable, "-c", _HANGS, redis_url], check=False, timeout=60)
    assert ran.returncode == -signal.SIGKILL


def test_an_order_for_others_is_declined_and_not_worked_on(place: Workplace, redis: Redis) -> None:
    attempt(place, order(avoid=("w1",)), doing(AssertionError("worked")))
    assert [event.kind for event in said(redis)] == [EventKind.DECLINED]


def test_an_order_that_was_called_back_is_left_alone(place: Workplace, redis: Redis) -> None:
    redis.set(wire.stop_key("a1"), place.settings.seals.sealed_stop("a1"))
    attempt(place, order(), doing(AssertionError("worked")))
    assert said(redis) == []


def test_an_order_that_arrives_twice_is_worked_on_once(place: Workplace, redis: Redis) -> None:
    lease = place.settings.seals.sealed_lease(Lease(attempt="a1", worker="w2", at_s=1.0))
    redis.set(wire.lease_key("a1"), lease)
    attempt(place, order(), doing(AssertionError("worked")))
    assert said(redis) == []
    assert redis.get(wire.lease_key("a1")) == lease.encode(), "the other's lease is untouched"


@pytest.mark.promise(
    "Between processes", "A stop signal or a lease that is not signed stops no task; it is counted and logged."
)
@pytest.mark.parametrize("kind", ["text", "signed for another attempt", "no text"])
def test_forged_stop_signals_and_leases_stop_nothing_and_are_counted(place: Workplace, redis: Redis, kind: str) -> None:
    def forge() -> None:
        for key in (wire.stop_key("a1"), wire.lease_key("a1")):
            redis.delete(key)
            if kind == "no text":
                redis.lpush(key, "1")
            else:
                redis.set(key, "1" if kind == "text" else place.settings.seals.sealed_stop("a2"))

    def do(place: Workplace, order: Order, monitor: ProgressMonitor) -> TaskResult:
        forge()
        until(lambda: redis.type(wire.lease_key("a1")) == b"string" and redis.get(wire.lease_key("a1")) != b"1")
        counted = refusals.count
        until(lambda: refusals.count > counted)
        assert not monitor.should_stop()
        return TaskResult()

    forge()
    counted = refusals.count
    attempt(place, order(), do)
    assert said(redis)[-1].kind is EventKind.DONE
    assert refusals.count >= counted + 3, "one signal and one lease at the start, and signals afterwards"


def test_an_attempt_whose_keys_are_forged_faster_than_it_reads_does_not_begin(redis_url: str, redis: Redis) -> None:
    client = BrokerClient(redis_url, "w1", seals=SEALS)
    read = client._claim

    def forge_and_read(**arguments: Any) -> Any:
        redis.set(wire.stop_key("a1"), f"{refusals.count}")
        return read(**arguments)

    client._claim = forge_and_read  # type: ignore[assignment]  # the forger
    assert not client.claim(order(), client.new_lease("a1"))
    assert said(redis) == []


def test_work_hears_the_stop_sign_while_it_works(place: Workplace, redis: Redis) -> None:
    def do(place: Workplace, order: Order, monitor: ProgressMonitor) -> TaskResult:
        redis.set(wire.stop_key("a1"), place.settings.seals.sealed_stop("a1"))
        while not monitor.should_stop():
            pass
        raise Stopped

    attempt(place, order(), do)
    failure = said(redis)[-1].failure
    assert failure is not None
    assert failure.code == "stopped"


def test_work_hears_that_its_worker_is_shut_down(place: Workplace, redis: Redis) -> None:
    def do(place: Workplace, order: Order, monitor: ProgressMonitor) -> TaskResult:
        assert not monitor.should_stop()
        place.settings.stopping_file.touch()
        assert monitor.should_stop()
        raise Stopped

    attempt(place, order(), do)
    assert said(redis)[-1].kind is EventKind.FAILED


def test_a_heart_beats_with_progress_and_keeps_the_lease(place: Workplace, redis: Redis) -> None:
    def do(place: Workplace, order: Order, monitor: ProgressMonitor) -> TaskResult:
        monitor.progress = 0.25
        while not any(event.kind is EventKind.HEARTBEAT for event in said(redis)):
            pass
        assert redis.pttl(wire.lease_key("a1")) > 0
        return TaskResult()

    attempt(place, order(), do)
    heartbeat = next(event for event in said(redis) if event.kind is EventKind.HEARTBEAT)
    assert heartbeat.progress == 0.25


def test_one_heartbeat_thread_serves_all_attempts_of_a_process(place: Workplace, redis: Redis) -> None:
    both = threading.Barrier(2, timeout=ENOUGH_S)

    def do(place: Workplace, order: Order, monitor: ProgressMonitor) -> TaskResult:
        both.wait()
        redis.delete(wire.lease_key(order.attempt))
        until(lambda: redis.exists(wire.lease_key(order.attempt)))
        assert [thread.name for thread in threading.enumerate()].count("heartbeat") == 1
        both.wait()
        return TaskResult()

    other = threading.Thread(target=attempt, args=(place, order(attempt="a2"), do))
    other.start()
    attempt(place, order(), do)
    other.join()
    ends = {event.attempt: event.kind for event in said(redis)}
    assert ends == {"a1": EventKind.DONE, "a2": EventKind.DONE}


def test_work_that_asks_whether_to_stop_does_not_hang_however_long_it_shows_no_progress(
    redis_url: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A scene may be parsed for days, within the limits of its job."""
    killed: list[int] = []
    monkeypatch.setattr("worker.report.os.kill", lambda pid, number: killed.append(number))
    times_s = [0.0]
    client = BrokerClient(redis_url, "w1", seals=SEALS)
    heart = AttemptHeartbeat(client, order(), worker_stopping=lambda: False, hung_s=10.0, clock=lambda: times_s[-1])
    for now_s in (9.0, 18.0, 27.0):
        times_s.append(now_s)
        assert not heart.should_stop()
        heart.beat()
    assert killed == []
    times_s.append(37.5)
    heart.beat()
    assert killed == [signal.SIGKILL]


def test_a_heart_that_has_ended_does_not_beat(redis_url: str, redis: Redis) -> None:
    client = BrokerClient(redis_url, "w1", seals=SEALS)
    with AttemptHeartbeat(client, order(), worker_stopping=lambda: False, hung_s=1.0) as heart:
        heart.beat()
        assert redis.delete(wire.lease_key("a1")) == 1
    heart.beat()
    assert not redis.exists(wire.lease_key("a1")), "a lease that was released stays released"


def test_a_lease_expires_by_itself(redis_url: str, redis: Redis) -> None:
    client = BrokerClient(redis_url, "w1", seals=SEALS)
    assert client.claim(order(), client.new_lease("a1"))
    assert 0 < redis.pttl(wire.lease_key("a1")) <= wire.LEASE_TTL_S * 1000


def test_the_heartbeat_renews_the_lease(place: Workplace, redis: Redis) -> None:
    half_ms = round(wire.LEASE_TTL_S * 500)

    def do(place: Workplace, order: Order, monitor: ProgressMonitor) -> TaskResult:
        redis.pexpire(wire.lease_key("a1"), half_ms)
        until(lambda: redis.pttl(wire.lease_key("a1")) > half_ms)
        return TaskResult()

    attempt(place, order(), do)
    assert said(redis)[-1].kind is EventKind.DONE
