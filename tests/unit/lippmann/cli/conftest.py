"""Commands that a test runs in its own process may change the umask, which other tests do not expect."""

from __future__ import annotations

import os
from collections.abc import Iterator

import pytest


@pytest.fixture(autouse=True)
def _umask() -> Iterator[None]:
    was = os.umask(0o022)
    os.umask(was)
    yield
    os.umask(was)
