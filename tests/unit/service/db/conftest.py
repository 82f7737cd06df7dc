"""The tests of this folder run on both databases."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.postgresql import DATABASES, new_database


@pytest.fixture(params=DATABASES)
def database_kind(request: pytest.FixtureRequest) -> str:
    """Return the kind of the database."""
    return str(request.param)


@pytest.fixture(params=DATABASES, scope="module")
def url(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """Lend the URL of an empty database that the tests of a module share."""
    if request.param == "sqlite":
        yield f"sqlite:///{tmp_path_factory.mktemp('database')}/test.db"
        return
    with new_database(request.getfixturevalue("postgresql")) as made:
        yield made
