"""A farm whose processes share nothing but a broker, a PostgreSQL and a bucket: each has a data folder of its own."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

from lippmann.client import Client
from tests.broker import Broker, free_port
from tests.farm import LIPPMANN, admin_key, wait_for_slots
from tests.object_store import ObjectStore
from tests.postgresql import new_database
from tests.waiting import ENOUGH_S, until

WORKERS = 2


@dataclass
class Cluster:
    """A cluster that is up."""

    folder: Path
    client: Client
    environment: dict[str, str]
    """The environment of the service, as `lippmann doctor` needs it."""
    workers: list[subprocess.Popen[bytes]]

    def data_dir(self, name: str) -> Path:
        return self.folder / name


@contextmanager
def cluster_up(folder: Path, *, postgresql: str, objects: ObjectStore) -> Iterator[Cluster]:
    """Run a service and two workers of one slot each; yield them once both workers are online."""
    broker, port, key_file = Broker(folder, keeps_data=True), free_port(), folder / "admin.key"
    order_key, bucket = folder / "order.key", objects.new_bucket()
    shared = {
        **os.environ,
        "LIPPMANN_REDIS_URL": broker.url,
        "LIPPMANN_ORDER_KEY_FILE": str(order_key),
        "LIPPMANN_STORE_URL": f"s3://{bucket}/farm",
        "LIPPMANN_S3_ENDPOINT": objects.endpoint,
        # A store that was away is noticed and tried again soon, so that a test is short.
        "LIPPMANN_STORE_CHECK_S": "1",
        "LIPPMANN_DEFERRAL_S": "2",
    }
    with ExitStack() as stack:
        stack.callback(broker.kill)
        database = stack.enter_context(new_database(postgresql))
        own = {"LIPPMANN_DATABASE_URL": database, "LIPPMANN_DATA_DIR": str(folder / "service")}

        def start(name: str, *command: str, **env: str) -> subprocess.Popen[bytes]:
            with (folder / f"{name}.log").open("ab") as log:
                process = subprocess.Popen(
                    [LIPPMANN, *command], env={**shared, **env}, stdout=log, stderr=subprocess.STDOUT
                )
            stack.callback(_end, process)
            return process

        start("service", "serve", "--port", str(port), "--key-file", str(key_file), **own)
        key = admin_key(key_file)
        until(order_key.exists)
        names = [f"worker{number}" for number in range(WORKERS)]
        workers = [
            start(name, "worker", "--slots", "1", LIPPMANN_WORKER_NAME=name, LIPPMANN_DATA_DIR=str(folder / name))
            for name in names
        ]
        with Client(f"http://127.0.0.1:{port}", key, patience_s=ENOUGH_S) as client:
            wait_for_slots(client, WORKERS)
            yield Cluster(folder, client, {**shared, **own}, workers)


def _end(process: subprocess.Popen[bytes]) -> None:
    process.terminate()
    process.wait(ENOUGH_S)
