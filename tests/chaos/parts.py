"""A farm of separate processes whose every part can be killed, stopped, cut off and started again.

It is a broker, a service and two workers with one slot each, which share a data folder. The service and each worker
reach the broker through a proxy of their own; or each worker is in a network namespace of its own and reaches the
broker through its link. Nothing restarts by itself: the harness is the service manager.
"""

from __future__ import annotations

import os
import signal
import subprocess
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from random import Random
from typing import Any

from lippmann.client import Client
from lippmann.farm.supervisor.descendants import descendants, kill
from tests.broker import Broker, free_port
from tests.farm import LIPPMANN, admin_key, wait_for_slots
from tests.network_host import NetworkHost, network_host
from tests.tcp_proxy import TcpProxy, tcp_proxy
from tests.waiting import ENOUGH_S
from worker.engines.mitsuba.session import PROGRAM

WORKERS = 2


@dataclass
class Part:
    """One process of the farm, with the command that starts it."""

    name: str
    command: list[str]
    env: Mapping[str, str]
    log: Path
    link: TcpProxy | NetworkHost
    """The way of this part to the broker."""
    process: subprocess.Popen[bytes] | None = field(default=None, init=False)

    def start(self) -> None:
        """Start the process, unless it lives."""
        if self.lives:
            return
        with self.log.open("ab") as log:
            self.process = subprocess.Popen(self.command, env=self.env, stdout=log, stderr=subprocess.STDOUT)

    @property
    def lives(self) -> bool:
        return self.process is not None and self.process.poll() is None

    @property
    def pid(self) -> int:
        assert self.process is not None
        return self.process.pid

    def send(self, number: signal.Signals) -> None:
        assert self.process is not None
        self.process.send_signal(number)

    def kill(self) -> None:
        """Kill the process alone; what is below it must end by itself."""
        self.send(signal.SIGKILL)
        assert self.process is not None
        self.process.wait()

    def kill_one(self, rng: Random) -> None:
        """Kill the process, one of its pool or a POV-Ray below it, unless the process is dead."""
        if not self.lives:
            return
        pid = rng.choice([self.pid, *self.pool(), *self.below("povray")])
        if pid == self.pid:
            self.kill()  # It also waits: a process takes a while to die, and `start` does nothing while it lives.
        else:
            kill({pid})

    def kill_all(self) -> None:
        """Kill the process and all below it at once, as when a host loses its power."""
        kill({self.pid, *descendants(self.pid)})
        assert self.process is not None
        self.process.wait()

    def terminate(self) -> None:
        """End the process as a service manager does."""
        self.send(signal.SIGTERM)
        assert self.process is not None
        self.process.wait(ENOUGH_S)

    def below(self, program: str) -> list[int]:
        """Return the processes of a program below this one."""
        return [pid for pid in sorted(descendants(self.pid)) if _program(pid) == program]

    def mitsuba(self) -> list[int]:
        """Return the programs of Mitsuba below this process; see `mitsuba_below`."""
        return mitsuba_below(self.pid)

    def pool(self) -> list[int]:
        """Return the pool processes: the children of a worker that have children."""
        return [pid for pid in sorted(descendants(self.pid)) if _parent(pid) == self.pid and descendants(pid)]


@dataclass
class Parts:
    """The parts of a farm, and a client of its service that waits for it through outages."""

    folder: Path
    broker: Broker
    service: Part
    workers: tuple[Part, ...]
    client: Client

    @property
    def data_dir(self) -> Path:
        return Path(self.service.env["LIPPMANN_DATA_DIR"])

    @property
    def redis(self) -> Any:
        """A client of the broker that goes through no proxy."""
        return self.broker.client

    @property
    def processes(self) -> tuple[Part, ...]:
        return self.service, *self.workers

    def heal(self) -> None:
        """Bring back whatever is away: every process, the broker and the network."""
        if self.broker.process.poll() is not None:
            self.broker.start()
        for part in self.processes:
            part.link.pass_on()
            part.start()


@contextmanager
def separate_parts(
    folder: Path,
    *,
    keeps_data: bool = False,
    hosts: bool = False,
    env: Mapping[str, str] | None = None,
    of_workers: Sequence[Mapping[str, str]] = ({},) * WORKERS,
) -> Iterator[Parts]:
    """Run a farm of separate processes.

    With `keeps_data`, its broker has its data again after a restart. With `hosts`, each worker is in a network
    namespace of its own. The environment `env` is that of all parts, and `of_workers` has more for each worker.
    """
    key_file, port = folder / "admin.key", free_port()
    shared = {**os.environ, "LIPPMANN_DATA_DIR": str(folder / "data"), **(env or {})}
    with ExitStack() as stack:
        networks = [stack.enter_context(network_host()) for _ in range(WORKERS if hosts else 0)]
        broker = Broker(folder, keeps_data=keeps_data, addresses=[network.here for network in networks])
        stack.callback(broker.kill)

        def part(name: str, *command: str, network: NetworkHost | None = None, **env: str) -> Part:
            link = network or stack.enter_context(tcp_proxy(("127.0.0.1", broker.port)))
            address = (link.here, broker.port) if isinstance(link, NetworkHost) else link.address
            assert isinstance(address, tuple)
            inside = network.inside if network else ()
            env |= {"LIPPMANN_REDIS_URL": f"redis://{address[0]}:{address[1]}/0"}
            made = Part(name, [*inside, LIPPMANN, *command], {**shared, **env}, folder / f"{name}.log", link)
            stack.callback(end, made)
            made.start()
            return made

        service = part("service", "serve", "--port", str(port), "--key-file", str(key_file))
        key = admin_key(key_file)
        places: Sequence[NetworkHost | None] = networks or [None] * WORKERS
        workers = tuple(
            part(f"worker{n}", "worker", "--slots", "1", network=place, LIPPMANN_WORKER_NAME=f"worker{n}", **more)
            for n, (place, more) in enumerate(zip(places, of_workers, strict=True))
        )
        url = f"http://127.0.0.1:{port}"
        with Client(url, key, patience_s=ENOUGH_S) as client:
            wait_for_slots(client, WORKERS)
            yield Parts(folder, broker, service, workers, client)


def end(part: Part) -> None:
    """End a part, also one that stands still."""
    if part.lives:
        part.send(signal.SIGCONT)
        try:
            part.terminate()
        except subprocess.TimeoutExpired:
            part.kill()


def mitsuba_below(pid: int) -> list[int]:
    """Return the programs of Mitsuba below a process, without the sandbox around them."""
    return [below for below in sorted(descendants(pid)) if _is_mitsuba(below)]


def stands_still(pid: int) -> bool:
    """Return whether a process is stopped or has ended."""
    words = _stat(pid)
    return not words or words[0] in "TtZX"


def cpu_s(pid: int) -> float:
    """Return the CPU seconds of a process; 0 if it has ended."""
    return sum(map(int, _stat(pid)[11:13])) / os.sysconf("SC_CLK_TCK")


def _is_mitsuba(pid: int) -> bool:
    try:
        words = Path(f"/proc/{pid}/cmdline").read_text().split("\0")
    except OSError:
        return False
    return Path(words[0]).name.startswith("python") and words[3:5] == list(PROGRAM)


def _program(pid: int) -> str:
    try:
        return Path(f"/proc/{pid}/comm").read_text().strip()
    except OSError:
        return ""


def _parent(pid: int) -> int:
    words = _stat(pid)
    return int(words[1]) if words else 0


def _stat(pid: int) -> list[str]:
    """Return the words of the state of a process, from the letter on; empty if it has ended."""
    try:
        return Path(f"/proc/{pid}/stat").read_text(errors="replace").rpartition(")")[2].split()
    except OSError:
        return []
