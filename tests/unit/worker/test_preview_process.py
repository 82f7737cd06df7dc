"""The process of a worker for previews starts when an order waits, and ends with the worker."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from lippmann.job.messages import wire
from tests.broker import Broker
from tests.builders_messages import SEALS
from worker.preview_orders import PreviewOrders
from worker.preview_process import PreviewProcess
from worker.settings import WorkerSettings


@pytest.fixture
def broker(tmp_path: Path) -> Iterator[Broker]:
    broker = Broker(tmp_path)
    yield broker
    broker.kill()


def process(broker: Broker, folder: Path, url: str = "", **settings: Any) -> PreviewProcess:
    orders = PreviewOrders(url or broker.url, "w1", None, seals=SEALS)
    return PreviewProcess(WorkerSettings(data_dir=folder, worker_name="w1", **settings), orders, ["sleep", "600"])


def test_it_starts_with_the_first_order_and_ends_with_the_worker(broker: Broker, tmp_path: Path) -> None:
    mine = process(broker, tmp_path)
    mine.look_after(True)
    assert not mine.is_running()
    broker.client.lpush(wire.preview_orders_key("w1"), "an order")
    mine.look_after(False)
    assert not mine.is_running()
    mine.look_after(True)
    assert mine.is_running()
    mine.end()
    assert not mine.is_running()
    mine.end()


def test_a_worker_without_the_right_or_the_will_offers_none(broker: Broker, tmp_path: Path) -> None:
    admin: Any = broker.client
    admin.execute_command("ACL", "SETUSER", "old", "reset", "on", ">p", "~lippmann:celery:*", "+@all")
    old = broker.url.replace("redis://", "redis://old:p@")
    assert not process(broker, tmp_path, old).is_offered
    assert not process(broker, tmp_path, previews=False).is_offered
    assert process(broker, tmp_path).is_offered
    broker.kill()
    assert process(broker, tmp_path).is_offered  # it may be back when previews are wanted
