"""The queue of pictures on demand: bounded, and fair between keys."""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import Callable
from typing import Any

import pytest

from service.errors import TooManyRequests
from service.limits import Limit
from service.viewing.queue import PictureQueue
from tests.waiting import ENOUGH_S


class Pictures:
    """Pictures of which each is made when the test lets it, in the order in which they were begun."""

    def __init__(self, *, budget_s: float = 120.0, **limits: int) -> None:
        self.budget = Limit(budget_s, "the test")
        self.queue = PictureQueue(**limits)
        self.begun: list[str] = []
        self.gate = threading.Semaphore(0)

    def make(self, name: str, seconds: float = 0.0) -> Callable[[], str]:
        def do() -> str:
            self.begun.append(name)
            assert self.gate.acquire(timeout=ENOUGH_S)
            time.sleep(seconds)
            return name

        return do

    def ask(self, key: str, name: str, seconds: float = 0.0) -> asyncio.Task[str]:
        return asyncio.create_task(self.queue.run(key, self.make(name, seconds), budget=self.budget))

    async def until_begun(self, count: int) -> None:
        while len(self.begun) < count:
            await asyncio.sleep(0.001)


def run(test: Callable[[], Any]) -> None:
    asyncio.run(asyncio.wait_for(test(), ENOUGH_S))


@pytest.mark.promise("People", "A viewer with many or expensive pictures does not stall others.")
def test_a_viewer_who_asks_for_many_pictures_stalls_nobody() -> None:
    async def test() -> None:
        pictures = Pictures(at_once=1)
        many = [pictures.ask("greedy", f"greedy {number}") for number in range(20)]
        await pictures.until_begun(1)
        other = pictures.ask("modest", "modest")
        await asyncio.sleep(0)
        pictures.gate.release(21)
        assert await other == "modest"
        assert pictures.begun.index("modest") <= 2
        assert len(await asyncio.gather(*many)) == 20

    run(test)


def test_expensive_pictures_cost_their_key_more_than_one_turn() -> None:
    async def test() -> None:
        pictures = Pictures(at_once=1)
        pictures.gate.release(100)
        slow = [pictures.ask("slow", "slow", 0.5) for _ in range(2)]
        await pictures.until_begun(1)
        quick = [pictures.ask("quick", "quick") for _ in range(4)]
        await asyncio.gather(*slow, *quick)
        assert pictures.begun == ["slow", *["quick"] * 4, "slow"]

    run(test)


def test_the_queue_is_bounded_by_key_and_in_all() -> None:
    async def test() -> None:
        pictures = Pictures(at_once=1, waiting=3, by_key=2)
        waiting = [pictures.ask("a", str(number)) for number in range(3)]
        await pictures.until_begun(1)
        with pytest.raises(TooManyRequests):
            await pictures.queue.run("a", pictures.make("refused"), budget=pictures.budget)
        waiting.append(pictures.ask("b", "b"))
        await asyncio.sleep(0)
        with pytest.raises(TooManyRequests):
            await pictures.queue.run("c", pictures.make("refused"), budget=pictures.budget)
        pictures.gate.release(4)
        assert len(await asyncio.gather(*waiting)) == 4
        assert "refused" not in pictures.begun

    run(test)


def test_a_client_that_leaves_gives_its_turn_to_the_next() -> None:
    async def test() -> None:
        pictures = Pictures(at_once=1)
        first, leaving, last = (pictures.ask("a", name) for name in ("first", "leaving", "last"))
        await pictures.until_begun(1)
        leaving.cancel()
        pictures.gate.release(2)
        assert (await first, await last) == ("first", "last")
        assert pictures.begun == ["first", "last"]

    run(test)


def test_a_picture_that_fails_frees_its_place() -> None:
    async def test() -> None:
        queue = PictureQueue(at_once=1)

        def fail() -> None:
            raise ValueError("broken")

        for _ in range(3):
            with pytest.raises(ValueError, match="broken"):
                await queue.run("a", fail, budget=Limit(120.0, "the test"))

    run(test)


def test_a_key_that_has_used_up_its_seconds_is_told_when_to_return_and_the_others_are_served() -> None:
    async def test() -> None:
        pictures = Pictures(budget_s=0.1)
        pictures.gate.release(100)
        await pictures.ask("greedy", "first", 0.3)  # three minutes of the budget
        with pytest.raises(TooManyRequests, match=r"expected at most 0\.1 \(the test\)") as refused:
            await pictures.ask("greedy", "second")
        assert 60 < refused.value.retry_after_s < ENOUGH_S
        assert await pictures.ask("modest", "modest") == "modest"
        assert pictures.begun == ["first", "modest"]

    run(test)


def test_a_picture_that_waited_while_others_used_up_the_seconds_is_not_made() -> None:
    async def test() -> None:
        pictures = Pictures(budget_s=0.1, at_once=1)
        first, second = pictures.ask("greedy", "first", 0.3), pictures.ask("greedy", "second")
        await pictures.until_begun(1)
        pictures.gate.release(100)
        with pytest.raises(TooManyRequests):
            await second
        assert (await first, pictures.begun) == ("first", ["first"])
        assert await pictures.ask("modest", "modest") == "modest"

    run(test)
