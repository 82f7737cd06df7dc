"""A farm on a new SQLite database for every test."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from shutil import copy
from typing import Any

import pytest

from service.auth import create_key
from service.db.engine import Database
from service.db.migrations import migrate
from service.main import create_app
from service.schemas.access import Role
from tests.builders_service import Client, Farm


@pytest.fixture(scope="session")
def empty_database(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Lend a database that was migrated once, to copy."""
    path = tmp_path_factory.mktemp("database") / "empty.db"
    database = Database(f"sqlite:///{path}")
    migrate(database)
    database.checkpoint()
    database.dispose()
    return path


@pytest.fixture
def make_farm(tmp_path: Path, empty_database: Path) -> Iterator[Callable[..., Farm]]:
    made: list[Farm] = []

    def make(**settings: Any) -> Farm:
        copy(empty_database, tmp_path / f"{len(made)}.db")
        made.append(Farm(f"sqlite:///{tmp_path}/{len(made)}.db", data_dir=tmp_path, **settings))
        return made[-1]

    yield make
    for farm in made:
        farm.database.dispose()


@pytest.fixture
def farm(make_farm: Callable[..., Farm]) -> Farm:
    return make_farm()


@pytest.fixture
def api_farm(make_farm: Callable[..., Farm]) -> Farm:
    """Lend a farm whose broker is not there: nothing that a request does may need it."""
    return make_farm(coordinator=False, redis_url="redis://127.0.0.1:1/0")


@pytest.fixture
def make_client() -> Iterator[Callable[[Farm], Client]]:
    """Lend clients with an admin's key, on a farm's database and store."""
    with ExitStack() as stack:

        def make(farm: Farm) -> Client:
            app = create_app(farm.settings, farm.parts, clock=lambda: farm.now_s)
            client = stack.enter_context(Client(app, raise_server_exceptions=False))
            with farm.writing() as session:
                client.headers["Authorization"] = f"Bearer {create_key(session, 'tester', Role.ADMIN)[1]}"
            return client

        yield make


@pytest.fixture
def api(api_farm: Farm, make_client: Callable[[Farm], Client]) -> Client:
    return make_client(api_farm)
