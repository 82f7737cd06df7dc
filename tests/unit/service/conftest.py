"""A farm on a new database for every test: SQLite, and PostgreSQL where a folder or a module asks for it."""

from __future__ import annotations

import secrets
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from shutil import copy
from typing import Any

import pytest

from service import health
from service.auth import create_key
from service.db.engine import Database
from service.db.migrations import migrate
from service.main import create_app
from service.metrics import readings
from service.schemas.access import Role
from tests.builders_service import Client, Farm
from tests.postgresql import new_database
from tests.postgresql import postgresql as postgresql
from tests.waiting import ENOUGH_S


@pytest.fixture(autouse=True)
def patient(monkeypatch: pytest.MonkeyPatch) -> None:
    """Wait for the answers of a machine that does much else; without this, health and metrics leave late ones out."""
    monkeypatch.setattr(health, "ANSWER_S", ENOUGH_S)
    monkeypatch.setattr(readings, "ANSWER_S", ENOUGH_S)


@pytest.fixture
def database_kind() -> str:
    """Return the kind of the database; the folders whose tests run on both kinds override this."""
    return "sqlite"


@pytest.fixture(scope="session")
def empty_sqlite(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Lend an SQLite database that was migrated once, to copy."""
    path = tmp_path_factory.mktemp("database") / "empty.db"
    database = Database(f"sqlite:///{path}")
    migrate(database)
    database.checkpoint()
    database.dispose()
    return path


@pytest.fixture(scope="session")
def empty_postgresql(postgresql: str) -> Iterator[str]:
    """Lend the name of a PostgreSQL database that was migrated once, to use as a template."""
    with new_database(postgresql) as url:
        database = Database(url)
        migrate(database)
        database.dispose()
        yield url.rpartition("/")[2]


@pytest.fixture
def new_url(database_kind: str, tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[Callable[[], str]]:
    """Lend a function that makes a migrated database and returns its URL."""
    with ExitStack() as stack:

        def new_sqlite() -> str:
            path = tmp_path / f"{secrets.token_hex(4)}.db"
            copy(request.getfixturevalue("empty_sqlite"), path)
            return f"sqlite:///{path}"

        def new_postgresql() -> str:
            server, template = request.getfixturevalue("postgresql"), request.getfixturevalue("empty_postgresql")
            return stack.enter_context(new_database(server, template=template))

        yield new_sqlite if database_kind == "sqlite" else new_postgresql


@pytest.fixture
def make_farm(new_url: Callable[[], str], tmp_path: Path) -> Iterator[Callable[..., Farm]]:
    made: list[Farm] = []

    def make(**settings: Any) -> Farm:
        made.append(Farm(new_url(), data_dir=tmp_path, **settings))
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
