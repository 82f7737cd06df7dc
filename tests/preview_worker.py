"""A worker that answers orders of previews, as a test tells it."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass, field

from lippmann.job.messages.previews import PreviewAnswer, PreviewMade, PreviewOrder
from lippmann.job.messages.seals import Seals
from tests.builders_messages import SEALS
from worker.preview_orders import PreviewOrders

MADE = PreviewMade(
    integral_png="aQ==", integral_size=(4, 4), view_png="dg==", view_size=(2, 2), start_s=0, render_s=0, pictures_s=0,
    cpu_s=0,
)  # fmt: skip


@dataclass
class Answering:
    """A worker that answers each order as told."""

    url: str
    answer: Callable[[PreviewOrder], PreviewAnswer | None] = lambda order: PreviewAnswer(
        id=order.id, worker="w1", made=MADE
    )
    seals: Seals = SEALS
    name: str = "w1"
    taken: list[str] = field(default_factory=list)

    def __enter__(self) -> Answering:
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        self._thread.join()

    def _run(self) -> None:
        orders = PreviewOrders(self.url, self.name, None, seals=self.seals)
        while not self._ended.is_set():
            order = orders.take(0.05)
            if order is not None:
                self.taken.append(order.id)
                found = self.answer(order)
                if found is not None:
                    orders.answer(found)
        orders.close()
