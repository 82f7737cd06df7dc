"""One preview over a real broker: answered, replaced before it begins, given up, refused, and forged."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Coroutine, Iterator
from pathlib import Path
from typing import Any, TypeVar

import pytest

from lippmann.errors import SceneError
from lippmann.job.messages import wire
from lippmann.job.messages.events import Failure
from lippmann.job.messages.previews import PreviewAnswer, PreviewMade, PreviewOrder
from service.errors import PreviewFailed, PreviewReplaced, TooManyRequests
from service.previews.prepare import Prepared
from service.previews.run import Previews
from service.roster import Roster, RosterCache
from service.settings import Settings
from tests.broker import Broker
from tests.builders_messages import SEALS
from tests.builders_service import owner
from tests.preview_worker import MADE, Answering
from tests.unit.service.previews.test_choose import job, worker
from tests.waiting import ENOUGH_S
from worker.preview_orders import PreviewOrders

ANN = owner("ann")

T = TypeVar("T")


class Known(RosterCache):
    """The roster of one worker."""

    def __init__(self) -> None:
        pass

    def latest(self) -> Roster:
        return Roster((worker("w1"),), {})


@pytest.fixture(scope="module")
def broker(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Broker]:
    broker = Broker(tmp_path_factory.mktemp("broker"))
    yield broker
    broker.kill()


@pytest.fixture
def previews(broker: Broker, tmp_path: Path) -> Iterator[Callable[..., Previews]]:
    made: list[Previews] = []

    def make(**settings: Any) -> Previews:
        given = Settings(data_dir=tmp_path, redis_url=broker.url, **settings)
        made.append(Previews(given, seals=SEALS))
        return made[-1]

    yield make
    for one in made:
        one.close()
    broker.client.flushall()


async def stays() -> bool:
    return False


def asked(
    previews: Previews, *, stream: str = "", is_gone: Callable[[], Awaitable[bool]] = stays
) -> Coroutine[Any, Any, tuple[str, PreviewMade]]:
    prepared = Prepared("fish", job(), 1, (), None)
    return previews.run(ANN, prepared, stream=stream, roster=Known(), is_gone=is_gone)


def run(work: Coroutine[Any, Any, T]) -> T:
    return asyncio.run(asyncio.wait_for(work, ENOUGH_S))


def test_a_preview_is_answered_and_leaves_nothing(broker: Broker, previews: Callable[..., Previews]) -> None:
    with Answering(broker.url):
        assert run(asked(previews())) == ("w1", MADE)
    left = broker.client.keys(wire.PREVIEWS + "*")
    assert [key for key in left if b":newest:" not in key] == []


def test_a_newer_preview_of_any_process_replaces_one_that_waits(
    broker: Broker, previews: Callable[..., Previews]
) -> None:
    async def both() -> tuple[tuple[str, PreviewMade], list[str]]:
        first = asyncio.ensure_future(asked(previews(), stream="page"))
        while not broker.client.exists(wire.preview_orders_key("w1")):
            await asyncio.sleep(0.01)
        second = asyncio.ensure_future(asked(previews(), stream="page"))
        with pytest.raises(PreviewReplaced):
            await first
        with Answering(broker.url) as answering:
            return await second, answering.taken

    answer, taken = run(both())
    assert answer == ("w1", MADE)
    assert len(taken) == 1  # the order of the first one is skipped


def test_a_preview_whose_client_has_gone_is_dropped(broker: Broker, previews: Callable[..., Previews]) -> None:
    async def goes() -> bool:
        return True

    with pytest.raises(PreviewReplaced):
        run(asked(previews(), is_gone=goes))
    with Answering(broker.url, lambda order: None) as answering:
        orders = PreviewOrders(broker.url, "w1", None, seals=SEALS)
        while orders.are_waiting():
            pass
    assert answering.taken == []


def test_a_worker_that_does_not_answer_is_waited_for_a_while(previews: Callable[..., Previews]) -> None:
    with pytest.raises(PreviewFailed, match=r"did not answer within 0\.5 s"):
        run(asked(previews(preview_timeout_s=0.5)))


@pytest.mark.parametrize(
    ("code", "error", "words"),
    [("scene", SceneError, "no such mesh"), ("out-of-memory", PreviewFailed, r"failed \(out-of-memory\): no such")],
)
def test_a_failure_says_why(
    broker: Broker, previews: Callable[..., Previews], code: str, error: type[Exception], words: str
) -> None:
    failure = Failure(code=code, message="no such mesh", permanent=True)
    with (
        Answering(broker.url, lambda order: PreviewAnswer(id=order.id, worker="w1", failure=failure)),
        pytest.raises(error, match=words),
    ):
        run(asked(previews()))


@pytest.mark.promise("Between processes", "A preview is rendered, and believed, only if it is signed.")
def test_orders_and_answers_that_are_not_signed_count_for_nothing(
    broker: Broker, previews: Callable[..., Previews]
) -> None:
    def forge(order: PreviewOrder) -> None:
        text = PreviewAnswer(id=order.id, worker="w1", made=MADE).model_dump_json()
        broker.client.lpush(wire.preview_answer_key(order.id), text)

    with Answering(broker.url, forge), pytest.raises(PreviewFailed):
        run(asked(previews(preview_timeout_s=1.0)))
    forged = PreviewOrder(id="0" * 32, worker="w1", job=job(), frame=1, timeout_s=9)
    broker.client.set(wire.preview_wanted_key(forged.id), "1")
    broker.client.lpush(wire.preview_orders_key("w1"), forged.model_dump_json())
    assert PreviewOrders(broker.url, "w1", None, seals=SEALS).take(0.1) is None


def test_a_key_asks_for_some_previews_a_minute(previews: Callable[..., Previews]) -> None:
    limited = previews(previews_per_minute=2)

    async def three() -> None:
        for _ in range(2):
            await limited.check_rate(ANN)
        with pytest.raises(TooManyRequests, match="at most 2 a minute"):
            await limited.check_rate(ANN)

    run(three())
