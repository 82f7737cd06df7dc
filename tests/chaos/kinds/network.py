"""Faults of the network between a part and the broker, which a proxy makes."""

from __future__ import annotations

import time
from collections.abc import Callable
from random import Random
from typing import Literal

from tests.chaos.kinds.kind import Injection, Kinds, pause
from tests.chaos.parts import Parts
from tests.tcp_proxy import TcpProxy

KINDS = Kinds()


def _network(whose: Literal["worker", "service"], change: Callable[[TcpProxy], None], seconds: float) -> Injection:
    def inject(parts: Parts, job_id: str, rng: Random) -> None:
        link = (parts.service if whose == "service" else rng.choice(parts.workers)).link
        assert isinstance(link, TcpProxy)
        change(link)
        pause(rng, 0.9 * seconds, 1.1 * seconds)
        link.pass_on()

    return inject


def _flaps(link: TcpProxy) -> None:
    for _ in range(20):
        link.cut()
        time.sleep(0.5)


NETWORKS: dict[str, tuple[Callable[[TcpProxy], None], float]] = {
    "cut": (TcpProxy.cut, 0.0),
    "cut every 0.5 s for 10 s": (_flaps, 0.0),
    "refused for 10 s": (TcpProxy.refuse, 10.0),
    "refused for 60 s": (TcpProxy.refuse, 60.0),
    "slow by 1.5 s for 30 s": (lambda link: link.delay(1.5), 30.0),
    "silent for 10 s": (TcpProxy.blackhole, 10.0),
    "silent for 60 s": (TcpProxy.blackhole, 60.0),
    "without answers for 10 s": (lambda link: link.blackhole("answers"), 10.0),
    "without requests for 10 s": (lambda link: link.blackhole("requests"), 10.0),
    "forgotten connections": (TcpProxy.abandon, 0.0),
}
for _what, (_change, _seconds) in NETWORKS.items():
    KINDS.add(f"network of a worker: {_what}", _network("worker", _change, _seconds))
    KINDS.add(f"network of the service: {_what}", _network("service", _change, _seconds))
