"""A farm of seven hosts: service, database, broker, store and three workers, each in a network namespace of its own.

They share nothing but the network of `tests.network_host`, which a test cuts, slows and silences between any two.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

from lippmann.client import Client
from tests.broker import Broker, free_port
from tests.chaos.parts import Part, Parts, end
from tests.farm import LIPPMANN, admin_key, wait_for_slots
from tests.network_host import NetworkHost, network_hosts
from tests.object_store import running_object_store
from tests.postgresql import new_database, running_postgresql
from tests.waiting import ENOUGH_S, until

SERVERS = ("service", "database", "broker", "store")
WORKERS = ("worker0", "worker1", "worker2")


@dataclass
class SevenHosts(Parts):
    """The parts of a farm, each with a host of its own."""

    hosts: Mapping[str, NetworkHost]

    def heal(self) -> None:
        """Bring back whatever is away."""
        for host in self.hosts.values():
            host.pass_on()
        super().heal()


@contextmanager
def seven_hosts(folder: Path, *, env: Mapping[str, str] | None = None) -> Iterator[SevenHosts]:
    """Run a farm on seven hosts; yield it once all workers are online."""
    key_file, order_key, port = folder / "admin.key", folder / "order.key", free_port()
    names = (*SERVERS, *WORKERS)
    with ExitStack() as stack:
        hosts = dict(zip(names, stack.enter_context(network_hosts(len(names))), strict=True))
        postgresql = stack.enter_context(running_postgresql(hosts["database"]))
        database = stack.enter_context(new_database(postgresql))
        objects = stack.enter_context(running_object_store(hosts["store"]))
        broker = Broker(folder, keeps_data=True, host=hosts["broker"])
        stack.callback(broker.kill)
        shared = {
            **os.environ,
            "LIPPMANN_REDIS_URL": broker.url,
            "LIPPMANN_ORDER_KEY_FILE": str(order_key),
            "LIPPMANN_STORE_URL": f"s3://{objects.new_bucket()}/farm",
            "LIPPMANN_S3_ENDPOINT": objects.endpoint,
            **(env or {}),
        }

        def part(name: str, *command: str, **own: str) -> Part:
            host = hosts[name]
            told = {**shared, **own, "LIPPMANN_DATA_DIR": str(folder / name)}
            made = Part(name, [*host.inside, LIPPMANN, *command], told, folder / f"{name}.log", host)
            stack.callback(end, made)
            made.start()
            return made

        address = hosts["service"].address
        serve = ("serve", "--host", address, "--port", str(port), "--key-file", str(key_file))
        service = part("service", *serve, LIPPMANN_DATABASE_URL=database)
        key = admin_key(key_file)
        until(order_key.exists)
        workers = tuple(part(name, "worker", "--slots", "1", LIPPMANN_WORKER_NAME=name) for name in WORKERS)
        with Client(f"http://{address}:{port}", key, patience_s=ENOUGH_S) as client:
            wait_for_slots(client, len(WORKERS))
            for host in hosts.values():  # Before anything ends, it can reach the others.
                stack.callback(host.pass_on)
            yield SevenHosts(folder, broker, service, workers, client, hosts)
