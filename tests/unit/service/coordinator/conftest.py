"""The tests of this folder run on both databases."""

from __future__ import annotations

import pytest

from tests.postgresql import DATABASES


@pytest.fixture(params=DATABASES)
def database_kind(request: pytest.FixtureRequest) -> str:
    """Return the kind of the database."""
    return str(request.param)
