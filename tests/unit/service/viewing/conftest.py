"""A farm whose store and pictures are real, so that frames can be looked into."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from lippmann.farm.adapters import make_parts
from service.store_identity import adopt_store
from tests.builders_service import Farm
from worker.store.opening import local_store


@pytest.fixture
def make_looked(tmp_path: Path, make_farm: Callable[..., Farm]) -> Callable[..., Farm]:
    def make(**settings: Any) -> Farm:
        farm = make_farm(coordinator=False, redis_url="redis://127.0.0.1:1/0", **settings)
        real = make_parts(local_store(tmp_path))
        farm.parts = replace(farm.parts, store=real.store, pictures=real.pictures)
        adopt_store(farm.database, real.store)
        return farm

    return make


@pytest.fixture
def looked(make_looked: Callable[..., Farm]) -> Farm:
    """Lend a farm with a real store and real pictures."""
    return make_looked()
