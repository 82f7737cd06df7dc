"""The real application with its real scene reader, on a database and a store of its own."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from lippmann.farm.adapters import make_parts
from service.auth import create_key
from service.db.engine import Database
from service.main import create_app
from service.schemas.access import Role
from service.settings import Settings
from tests.builders_service import Client
from worker.store.opening import local_store


@contextmanager
def running_app(folder: Path) -> Iterator[Client]:
    """Lend a client with an admin's key and no limit of requests; no broker is there, and nothing is rendered."""
    settings = Settings(
        data_dir=folder, coordinator=False, redis_url="redis://127.0.0.1:1/0", requests_per_minute=10**9,
        requests_per_minute_by_address=10**9, max_open_jobs=10**9, max_open_frames=10**9,
    )  # fmt: skip
    with Client(create_app(settings, make_parts(local_store(folder))), raise_server_exceptions=False) as client:
        database = Database(settings.database)
        with database.writing() as session:
            client.headers["Authorization"] = f"Bearer {create_key(session, 'tester', Role.ADMIN)[1]}"
        database.dispose()
        yield client
