"""Each of the two kinds of databases."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.postgresql import new_database
from tests.postgresql import postgresql as postgresql


@pytest.fixture(params=["sqlite", "postgresql"], scope="module")
def url(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """Lend the URL of an empty database."""
    if request.param == "sqlite":
        yield f"sqlite:///{tmp_path_factory.mktemp('database')}/test.db"
        return
    with new_database(request.getfixturevalue("postgresql")) as made:
        yield made
