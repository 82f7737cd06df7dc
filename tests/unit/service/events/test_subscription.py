"""The queue of one client: bounded, in order, and nothing twice."""

from __future__ import annotations

import asyncio

import pytest

from service.db.events import StoredEvent
from service.events import subscription as module
from service.events.sse import ALIVE, encode
from service.events.subscription import QUEUE_BYTES, Batch, Subscription
from service.schemas.events import EventTopic


def _event(number: int, job: str = "a", data: str = "{}") -> StoredEvent:
    return StoredEvent(number, job, EventTopic.PROGRESS, data)


def _batch(*numbers: int, job: str = "a") -> Batch:
    return Batch([_event(number, job) for number in numbers])


def _following(position: int, *, sent: int | None = None, job: str | None = None) -> Subscription:
    client = Subscription(job_id=job, caller_id="k", sent=position if sent is None else sent)
    client.follow(position)
    return client


def _ids(data: bytes) -> list[int]:
    return [int(line.split()[1]) for line in data.splitlines() if line.startswith(b"id: ")]


def test_a_client_receives_what_is_pushed_in_order_and_once() -> None:
    client = _following(3)
    client.push(_batch(4, 5))
    client.push(_batch(6))
    assert _ids(client.take()) == [4, 5, 6]
    assert (client.sent, client.take()) == (6, b"")


def test_a_client_that_is_ahead_of_the_hub_receives_nothing_twice() -> None:
    client = _following(3, sent=5)
    client.push(_batch(4, 5, 6))
    client.push(_batch(7))
    assert _ids(client.take()) == [6, 7]


def test_a_client_that_joined_after_a_batch_was_read_does_not_receive_it() -> None:
    client = _following(6)
    client.push(_batch(4, 5, 6))
    assert client.take() == b""


def test_a_client_receives_only_its_job() -> None:
    client = _following(0, job="b")
    client.push(Batch([_event(1, "a"), _event(2, "b"), _event(3, "a")]))
    assert (_ids(client.take()), client.sent) == ([2], 3)


def test_a_batch_is_encoded_once_and_all_clients_share_its_bytes(monkeypatch: pytest.MonkeyPatch) -> None:
    encoded = []

    def count(identifier: int, topic: str, data: str) -> bytes:
        encoded.append(identifier)
        return encode(identifier, topic, data)

    monkeypatch.setattr(module, "encode", count)
    batch = _batch(1, 2, 3)
    clients = [_following(0) for _ in range(50)]
    for client in clients:
        client.push(batch)
    assert encoded == [1, 2, 3]
    assert len({id(client.take()) for client in clients}) == 1


def test_a_slow_client_falls_behind_and_holds_nothing() -> None:
    client = _following(0)
    big = '{"a": "%s"}' % ("x" * (QUEUE_BYTES // 3))
    for number in range(1, 100):
        client.push(Batch([_event(number, data=big)]))
        assert sum(map(len, client._pieces)) <= QUEUE_BYTES
    assert client.lags
    assert (client.take(), client.sent) == (b"", 0)


def test_an_idle_client_takes_a_batch_of_any_size() -> None:
    client = _following(0)
    client.push(Batch([_event(1, data='{"a": "%s"}' % ("x" * 2 * QUEUE_BYTES))]))
    assert (_ids(client.take()), client.lags) == ([1], False)


def test_a_client_that_has_caught_up_continues_behind_what_it_read() -> None:
    client = _following(0)
    client.lags = True
    client.push(_batch(1, 2))
    client.follow(2)
    client.push(_batch(3))
    client.sent = 2  # as read from the database
    assert (_ids(client.take()), client.sent) == ([3], 3)


def test_a_comment_is_sent_only_to_an_idle_client() -> None:
    client = _following(0)
    client.keep_alive()
    client.keep_alive()
    assert client.take() == ALIVE
    client.push(_batch(1))
    client.keep_alive()
    assert _ids(client.take()) == [1]
    client.lags = True
    client.keep_alive()
    assert client.take() == b""


def test_the_last_line_of_a_stream_is_the_first_reason_of_its_end() -> None:
    client = _following(0)
    client.push(_batch(1))
    client.end("no more")
    client.end("again")
    client.push(_batch(2))
    assert (client.is_ended, client.take()) == (True, b": no more\n\n")


def test_waiting_ends_when_something_is_queued() -> None:
    async def wait() -> bytes:
        client = _following(0)
        waiting = asyncio.create_task(client.wait())
        await asyncio.sleep(0)
        assert not waiting.done()
        client.push(_batch(1))
        await waiting
        return client.take()

    assert _ids(asyncio.run(wait())) == [1]
