"""The dashboard in an application of its own, with its broker away."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from service.auth import create_login_token
from service.main import create_app
from service.settings import Settings
from tests.builders_service import Client, parts


@pytest.fixture
def stranger(tmp_path: Path) -> Iterator[Client]:
    """Lend a client that nobody knows."""
    settings = Settings(data_dir=tmp_path, coordinator=False, redis_url="redis://127.0.0.1:1/0")
    with Client(create_app(settings, parts()), raise_server_exceptions=False) as client:
        yield client


@pytest.fixture
def guest(stranger: Client) -> Client:
    """Lend a client with a browser session."""
    with stranger.app.state.lippmann.database.writing() as session:  # type: ignore[attr-defined]
        token = create_login_token(session)
    stranger.get("/login", params={"token": token})
    return stranger
